"""How fast simulated time passes, and how far."""
