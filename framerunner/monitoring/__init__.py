"""Recorded flights for the monitor: the runs of a folder, and the process that reads one."""
