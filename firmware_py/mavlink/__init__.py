"""PX4's MAVLink in services: bytes in, bytes out, with the time as an argument; no clock, no socket."""
