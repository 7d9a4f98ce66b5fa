"""Where the drone is in the arena, by its IMU, its reported states, and what its camera sees."""
