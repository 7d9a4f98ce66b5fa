"""What has been seen of the arena, and what could be seen next."""
