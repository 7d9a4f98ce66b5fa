"""Whether a MAVLink drone can fly the challenge. It listens and requests; it changes nothing in the drone."""
