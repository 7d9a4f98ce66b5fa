"""Evaluations: many flights on all cores or a cluster, kept as they end, then counted and reported."""

COUNT, SEED = 100, 1  # of the scenarios of a level, if none are given
