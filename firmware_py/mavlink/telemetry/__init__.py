"""Telemetry: streamed and requested messages."""
