"""Missions, fences and rally points: storage, checks and execution, independent of MAVLink's messages."""
