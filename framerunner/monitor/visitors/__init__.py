"""Who visits the monitor: the class, whose connection it is, and how often log-ins may be tried."""
