"""The autopilot: sensors in, motor speeds out, MAVLink bytes both ways. It reads no clock and opens no socket."""
