"""MAVLink as PX4 speaks it, in services. Bytes in, bytes out, time given; no clock, no socket."""
