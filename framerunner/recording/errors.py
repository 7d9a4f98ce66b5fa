"""Errors of recordings."""

from errors import UserError


class RecordingError(UserError):
    """A recording that cannot be written or shown; the message is one line for people."""
