"""Mission files: from YAML text with line numbers to a checked statechart of python-statemachine."""
