"""What a small network that was trained on painted images proposes."""
