"""MAVLink services of the autopilot, one module each."""
