"""How paths are flown: the commands."""
