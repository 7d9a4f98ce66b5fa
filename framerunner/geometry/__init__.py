"""Vectors, rotations, and the axes that the rooms use."""
