"""The autopilot: from sensors and MAVLink bytes to motor speeds and MAVLink bytes. No clock, no socket."""
