"""The Game Monitor: drones, missions, tries and replays in a browser."""

FIRST_VIEWER = "a browser shows the monitor"
"""Said once on standard error; the program that started the monitor may wait for it."""
