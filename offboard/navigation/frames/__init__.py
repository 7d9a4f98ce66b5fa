"""The map of frames: where each one is, by all images so far."""
