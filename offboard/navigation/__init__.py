"""Navigation by a map of gates: seen, remembered, planned, flown."""
