"""What is said of edits that cannot be applied; the words are in `texts.yaml`."""

from __future__ import annotations

from pathlib import Path

from framerunner.errors import UserError
from offboard.chart.mission_texts import Message


class EditText(Message):
    """A text about an edit."""

    table = Path(__file__).with_name("texts.yaml")


class EditError(UserError):
    """An edit cannot be applied, and nothing was changed; the text is one line for people, in English.

    Args:
        code: of the kind of fault.
        values: that its text has.

    Attributes:
        message: the same as code and values, for other languages.
    """

    def __init__(self, code: str, **values: object) -> None:
        self.message = EditText(code, **values)
        super().__init__(str(self.message))
