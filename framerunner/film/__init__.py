"""Short films of flights: what is shown (story), how it is painted (sheet), how it is kept (film file)."""
