"""Mission files: from YAML text with line numbers to a checked statechart and the table that is flown."""
