"""What makes images hard: the camera's optics and electronics, and what hangs and lies around the arena."""
