"""A camera for a drone that has none: images rendered from the pose that its telemetry reports."""
