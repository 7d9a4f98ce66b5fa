"""`framerunner mocap`: poses of a motion capture for any MAVLink vehicle, and a check that it uses them."""
