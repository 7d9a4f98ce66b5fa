"""The navigator: missions, the primitives they call, and the drones they fly."""
