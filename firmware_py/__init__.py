"""The autopilot: sensors in, motor speeds out, MAVLink bytes both ways. No clock, no socket."""
