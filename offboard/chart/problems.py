"""What is wrong with a mission file, and where."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from difflib import get_close_matches

from errors import UserError

MAX_REPORTED = 50


@dataclass(frozen=True, slots=True)
class Place:
    """A place in a mission file."""

    file: str
    line: int = 0  # counted from 1; 0 for the whole file
    column: int = 0  # counted from 1; 0 for the whole line

    def __str__(self) -> str:
        numbers = (number for number in (self.line, self.column) if number)
        return ":".join((self.file, *map(str, numbers)))

    def moved(self, characters: int) -> Place:
        """The place some characters further on in the line; the same if the column is not known."""
        return replace(self, column=self.column + characters) if self.column else self


NOWHERE = Place("")


class MissionError(UserError):
    """A mission file cannot be flown; the message has one line for each problem."""


def problem(place: Place, text: str) -> str:
    """A problem as one line."""
    line = f"{place}: {text}"
    # A file may hold anything; printed text of it must not move the terminal's cursor.
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)


def mission_error(place: Place, text: str) -> MissionError:
    """The error for a single problem."""
    return MissionError(problem(place, text))


@dataclass(slots=True)
class ProblemList:
    """Collects problems, so that a pupil sees all of them at once.

    Of each place only the first is kept: a template is checked for each of its uses, and a second fault of
    the same word mostly follows from the first.
    """

    _by_place: dict[Place, str] = field(default_factory=dict)

    @property
    def found(self) -> bool:
        """Whether there is any."""
        return bool(self._by_place)

    def add(self, place: Place, text: str) -> None:
        """Note a problem."""
        self._by_place.setdefault(place, text)

    def remove(self, place: Place) -> None:
        """Forget the problem at a place, because there is a better message."""
        self._by_place.pop(place, None)

    def raise_if_any(self) -> None:
        """Raise a `MissionError` with all problems, in order of file, line and column."""
        if self.found:
            order = sorted(self._by_place, key=lambda place: (place.file, place.line, place.column))
            lines = [problem(place, self._by_place[place]) for place in order[:MAX_REPORTED]]
            if len(order) > MAX_REPORTED:
                more = f"and {len(order) - MAX_REPORTED} more mistakes"
                lines.append(problem(Place(order[0].file), more))
            raise MissionError("\n".join(lines))


def cut(text: str, max_characters: int = 60) -> str:
    """A text of a file as it is quoted in a problem: not too long."""
    return text if len(text) <= max_characters else f"{text[: max_characters - 3]}..."


def did_you_mean(name: str, known: Iterable[str], otherwise: str, owner: str = "") -> str:
    """Suggest the known name that is most similar, after its `owner` such as "cmd."; or `otherwise`."""
    similar = get_close_matches(name, known, 1)
    return f"did you mean '{owner}{similar[0]}'?" if similar else otherwise
