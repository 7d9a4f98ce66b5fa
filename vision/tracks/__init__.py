"""Points that are followed from image to image."""
