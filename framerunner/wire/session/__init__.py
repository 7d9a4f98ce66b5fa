"""A client's session with one vehicle: what it sends, what it is asked, and what it answers."""
