"""The parameter protocols."""
