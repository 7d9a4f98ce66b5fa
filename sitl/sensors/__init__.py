"""Models of the drone's sensors: measurements with their errors, made from the true motion."""
