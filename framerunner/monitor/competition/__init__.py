"""The contest: teams, rounds, tries, judges' corrections and the ranking, kept in a database."""
