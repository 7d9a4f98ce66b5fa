"""What the editor's server says to its pages; the words are in `texts.yaml`."""

from __future__ import annotations

from pathlib import Path

from starlette.requests import HTTPConnection

from framerunner.errors import UserError
from offboard.authoring import EditError
from offboard.chart.mission_texts import Language, Message
from offboard.chart.problems import MAX_REPORTED, MissionError


class Said(Message):
    """A text of the server."""

    table = Path(__file__).with_name("texts.yaml")


class SaidError(UserError):
    """Something that a page asked for cannot be done.

    Attributes:
        message: why, in words for people of any language.
    """

    def __init__(self, code: str, **values: object) -> None:
        self.message = Said(code, **values)
        super().__init__(str(self.message))


def language_of(connection: HTTPConnection) -> Language:
    """The language of a page, which its requests name."""
    return "es" if connection.query_params.get("language") == "es" else "en"


def reason(error: UserError, language: Language) -> str:
    """Why something failed, one line; in English if its words are in no table."""
    return reasons(error, language)[0]


def reasons(error: UserError, language: Language) -> tuple[str, ...]:
    """Likewise, a line for each fault of a mission."""
    if isinstance(error, SaidError | EditError):
        return (" ".join(error.message.text(language).split()),)
    if isinstance(error, MissionError):
        if language == "en" or not error.problems:
            return tuple(str(error).splitlines())
        return tuple(each.line(language) for each in error.problems[:MAX_REPORTED])
    return (" ".join(str(error).split()),)
