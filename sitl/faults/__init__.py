"""Faults that really act: on samples of sensors, motors, battery, images and the link."""
