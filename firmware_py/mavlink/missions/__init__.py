"""The mission protocol, and what a mission in flight tells and commands."""
