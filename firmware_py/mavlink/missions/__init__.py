"""The mission protocol, and the reports and commands of a mission in flight."""
