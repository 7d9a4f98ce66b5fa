"""The network that proposes gates: its data, its training."""
