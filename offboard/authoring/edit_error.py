"""The error of an edit that cannot be applied."""

from __future__ import annotations

from errors import UserError
from offboard.authoring.messages import EditMessage


class EditError(UserError):
    """An edit cannot be applied, and nothing was changed; the text is one line for people, in English.

    Args:
        code: of the kind of fault; see `messages`.
        values: that its text has.

    Attributes:
        message: the same as code and values, for other languages.
    """

    def __init__(self, code: str, **values: object) -> None:
        self.message = EditMessage(code, **values)
        super().__init__(str(self.message))
