"""Recordings of flights as MCAP files, and their replay."""
