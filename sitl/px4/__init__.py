"""PX4's own autopilot in the simulated world, over its simulator interface."""
