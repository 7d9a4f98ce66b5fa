"""What an autopilot and a simulated world share: airframe, sensor samples, places on Earth, the air."""
