"""The optics and electronics of the simulated camera, from what is painted to the image it gives."""
