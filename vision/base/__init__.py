"""The base as a landmark: a cube of known size, found by its edges where it is expected."""
