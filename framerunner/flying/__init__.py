"""How a flight is flown: its plan, and real time or lockstep to fly it in."""
