"""One vehicle as it shows itself on the link: each module follows one kind of message."""
