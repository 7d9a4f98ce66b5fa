"""Calibration of cameras: the board, what is computed from its images, and the use of the result."""
