"""A camera for a drone that has none: painted from the pose that its telemetry reports."""
