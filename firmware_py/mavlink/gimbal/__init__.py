"""The gimbal: its device, a component beside the autopilot, and its manager in the autopilot."""
