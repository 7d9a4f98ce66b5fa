"""The map of gates: where each one is, by all images so far."""
