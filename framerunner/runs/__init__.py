"""What a flight leaves behind: its folder, track, video and pictures."""
