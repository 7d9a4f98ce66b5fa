"""What becomes text: errors for people, values for JSON."""
