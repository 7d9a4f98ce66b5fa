"""Calibration of a camera from the command line."""
