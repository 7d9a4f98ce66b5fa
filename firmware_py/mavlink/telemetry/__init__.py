"""Telemetry: what is streamed, and on which requests."""
