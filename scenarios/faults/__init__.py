"""Faults of a flight: what can be declared, their one-line grammar, random faults, and how flights end."""
