"""What the simulators of genuine autopilots share."""
