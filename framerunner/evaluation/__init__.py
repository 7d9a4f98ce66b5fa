"""Many flights at once: flown on all cores or a cluster, kept as they end, counted and reported."""
