"""What the drone is to fly now: offboard setpoints and a pilot's sticks."""
