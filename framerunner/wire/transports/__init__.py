"""Links: their URLs, and UDP, TCP and serial transports that carry bytes."""
