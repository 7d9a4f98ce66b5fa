"""The camera, a component beside the autopilot."""
