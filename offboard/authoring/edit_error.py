"""The error of an edit that cannot be applied."""

from __future__ import annotations

from errors import UserError


class EditError(UserError):
    """An edit cannot be applied, and nothing was changed; the message is one line for people."""
