"""How a flight is flown: its plan, and flights in real time and in lockstep."""
