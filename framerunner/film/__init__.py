"""Short films of flights: what is shown when (timeline), how it is painted, and the file it is written to."""
