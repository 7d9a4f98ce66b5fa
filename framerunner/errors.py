"""Errors of the front door."""


class SettingError(ValueError):
    """A setting that cannot be used; the message is one line for people."""
