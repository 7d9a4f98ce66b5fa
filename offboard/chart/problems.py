"""What is wrong with a mission file, and where."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from errors import UserError


@dataclass(frozen=True, slots=True)
class Place:
    """A place in a mission file.

    Attributes:
        file: its name.
        line: counted from 1; 0 stands for the whole file.
        column: counted from 1; 0 stands for the whole line.
    """

    file: str
    line: int = 0
    column: int = 0

    def __str__(self) -> str:
        numbers = (number for number in (self.line, self.column) if number)
        return ":".join((self.file, *map(str, numbers)))

    def moved(self, characters: int) -> Place:
        """The place some characters further on in the line; the same if the column is not known."""
        return replace(self, column=self.column + characters) if self.column else self


NOWHERE = Place("")
MAX_TOLD = 50


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing to mend."""

    place: Place
    text: str

    def __str__(self) -> str:
        line = f"{self.place}: {self.text}"
        # A file may hold anything; what it makes us print must not move the terminal's cursor.
        return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)


class MissionError(UserError):
    """A mission file cannot be flown; the message has one line for each problem."""

    def __init__(self, problems: list[Problem]) -> None:
        super().__init__("\n".join(str(problem) for problem in problems))
        self.problems = tuple(problems)


@dataclass(slots=True)
class ProblemList:
    """Collects problems, so that a pupil sees all of them at once.

    Of one place only the first is told: what stands in a template is looked at once for each of its uses, and
    a second fault of the same word mostly follows from the first.
    """

    _by_place: dict[Place, Problem] = field(default_factory=dict)

    @property
    def found(self) -> bool:
        """Whether there is any."""
        return bool(self._by_place)

    def add(self, place: Place, text: str) -> None:
        """Note a problem."""
        self._by_place.setdefault(place, Problem(place, text))

    def take_back(self, place: Place) -> None:
        """Forget what was said of a place; a better word for it has been found."""
        self._by_place.pop(place, None)

    def raise_if_any(self) -> None:
        """Stop if anything was found, in order of file, line and column.

        Raises:
            MissionError: with all problems.
        """
        if self.found:
            order = sorted(self._by_place, key=lambda place: (place.file, place.line, place.column))
            problems = [self._by_place[place] for place in order]
            if len(problems) > MAX_TOLD:
                rest = Problem(Place(order[0].file), f"and {len(problems) - MAX_TOLD} more mistakes")
                problems = [*problems[:MAX_TOLD], rest]
            raise MissionError(problems)


def cut(text: str, longest: int = 60) -> str:
    """A text of a file as it is quoted in a problem: not too long."""
    return text if len(text) <= longest else f"{text[: longest - 3]}..."
