"""A genuine ArduCopter as the autopilot of a simulated drone, over its JSON interface."""
