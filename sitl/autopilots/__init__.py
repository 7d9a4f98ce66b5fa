"""What the simulators of genuine autopilots share."""

TITLES = {"px4": "PX4", "ardupilot": "ArduPilot"}
"""For people, by the names that options have."""

WARNING = "warning: "
"""Begins a notice that also the program shows which has started the simulator."""
