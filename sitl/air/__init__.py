"""The moving air of the simulated world."""
