"""What the monitor is given: links, referees, scenarios and recorded flights."""
