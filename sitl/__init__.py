"""The simulated world: physics, camera, clock and links."""
