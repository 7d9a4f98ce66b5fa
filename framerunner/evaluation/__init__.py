"""Evaluations: many flights on all cores or a cluster, kept as they end, then counted and reported."""
