"""The parts of the MAVLink adapter: addresses, telemetry, axes, watchdog, recording."""
