"""The camera, a component of its own."""
