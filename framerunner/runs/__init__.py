"""What a flight leaves: its folder, result, track, plot and video."""
