"""Guidance: what each flight mode asks of the stabiliser."""
