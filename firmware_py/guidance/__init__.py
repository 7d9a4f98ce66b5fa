"""Guidance: the flight modes and their commands to the stabiliser."""
