"""Errors of recordings."""

from framerunner.errors import SettingError


class RecordingError(SettingError):
    """A recording that cannot be written or shown; the message is one line for people."""
