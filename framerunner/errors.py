"""Errors of the front door."""

from errors import UserError


class SettingError(UserError):
    """A setting that cannot be used; the message is one line for people."""
