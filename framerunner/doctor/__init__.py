"""What a drone says of itself, and what it lacks for the challenge. Listens and asks; changes nothing."""
