"""The parts of the MAVLink adapter: telemetry, commands, tracking, watchdog, companion, recording."""
