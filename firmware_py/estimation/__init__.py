"""The estimate of the vehicle's state from measurements."""
