"""What is wrong with a mission file, and where."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Literal

from framerunner.errors import UserError
from framerunner.files.yaml_text import Place
from offboard.chart.mission_texts import Language, Message, as_message

MAX_REPORTED = 50
MAX_NOTED = 500
MAX_COMPARED = 200
"""Names that are compared with an unknown one to find the most similar; comparing is slow."""

Severity = Literal["error", "warning", "advice"]
"""An error: the mission is not flown. A warning: a part of it does nothing. Advice: what may go wrong."""


NOWHERE = Place("")


@dataclass(frozen=True, slots=True)
class MissionProblem:
    """One finding of the checker."""

    place: Place
    message: Message
    severity: Severity = "error"

    def __str__(self) -> str:
        return self.line()

    def line(self, language: Language = "en") -> str:
        """Place and words, by a table of texts."""
        kind = "" if self.severity == "error" else f"{self.severity}: "
        line = f"{self.place}: {kind}{self.message.text(language)}"
        # A file may hold anything; printed text of it must not move the terminal's cursor.
        return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)


class MissionError(UserError):
    """A mission file cannot be flown; the message has one line for each problem.

    Attributes:
        problems: the same with codes and places, all of them.
    """

    def __init__(self, text: str, problems: tuple[MissionProblem, ...] = ()) -> None:
        super().__init__(text)
        self.problems = problems

    def __reduce__(self) -> tuple[type[MissionError], tuple[str, tuple[MissionProblem, ...]]]:
        return MissionError, (str(self), self.problems)


def mission_error(place: Place, text: Message | str) -> MissionError:
    """The error for a single problem."""
    found = MissionProblem(place, as_message(text))
    return MissionError(str(found), (found,))


@dataclass(slots=True)
class ProblemList:
    """Collects problems, so that a pupil sees all of them at once.

    Of each place only the first is kept: a template is checked for each of its uses, and a second fault of
    the same word mostly follows from the first.
    """

    _by_place: dict[Place, MissionProblem] = field(default_factory=dict)

    @property
    def found(self) -> bool:
        """Whether there is an error."""
        return any(each.severity == "error" for each in self._by_place.values())

    @property
    def full(self) -> bool:
        """Whether there are so many that looking for more is a waste of time."""
        return len(self._by_place) > MAX_NOTED

    @property
    def all(self) -> tuple[MissionProblem, ...]:
        """In order of file, line and column."""
        order = sorted(self._by_place, key=lambda place: (place.file, place.line, place.column))
        return tuple(self._by_place[place] for place in order)

    def add(self, place: Place, message: Message, severity: Severity = "error") -> None:
        """Note a problem; an error replaces a warning of the same place."""
        known = self._by_place.get(place)
        if known is None or (known.severity != "error" and severity == "error"):
            self._by_place[place] = MissionProblem(place, message, severity)

    def add_all(self, other: ProblemList) -> None:
        """Note all problems of another list."""
        for each in other.all:
            self.add(each.place, each.message, each.severity)

    def remove(self, place: Place) -> None:
        """Forget the problem at a place, because there is a better message."""
        self._by_place.pop(place, None)

    def raise_if_any(self) -> None:
        """Raise a `MissionError` with all errors, in order of file, line and column."""
        if self.found:
            errors = tuple(each for each in self.all if each.severity == "error")
            lines = [str(each) for each in errors[:MAX_REPORTED]]
            if len(errors) > MAX_REPORTED:
                more = f"and {len(errors) - MAX_REPORTED} more mistakes"
                lines.append(str(MissionProblem(Place(errors[0].place.file), as_message(more))))
            raise MissionError("\n".join(lines), errors)


def cut(text: str, max_characters: int = 60) -> str:
    """A text of a file as it is quoted in a problem: not too long."""
    return text if len(text) <= max_characters else f"{text[: max_characters - 3]}..."


def did_you_mean(name: str, known: Iterable[str], otherwise: Message | str, owner: str = "") -> Message:
    """Suggest the known name that is most similar, after its `owner` such as "cmd."; or `otherwise`."""
    names = list(known)
    similar = get_close_matches(name, names, 1) if len(names) <= MAX_COMPARED and len(name) < 100 else []
    return Message("did_you_mean", name=f"{owner}{similar[0]}") if similar else as_message(otherwise)
