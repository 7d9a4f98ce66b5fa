"""How a vehicle follows commands: identified in flight."""
