"""Commands: one table from MAV_CMD to handler."""
