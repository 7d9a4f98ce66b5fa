"""The monitor's pages: those that JavaScript draws (`table`), log-in, `/join`, and the frame of all."""
