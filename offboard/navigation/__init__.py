"""Navigation by a map of frames: seen, remembered, planned, flown."""
