"""The parts of `planning.plan`; nothing else imports them."""
