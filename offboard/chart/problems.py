"""What is wrong with a mission file, and where."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Place:
    """A line of a mission file; line 0 stands for the whole file."""

    file: str
    line: int = 0

    def __str__(self) -> str:
        return f"{self.file}:{self.line}" if self.line else self.file


@dataclass(frozen=True, slots=True)
class Problem:
    """One thing to mend."""

    place: Place
    text: str

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


class MissionError(Exception):
    """A mission file cannot be flown; the message has one line for each problem."""

    def __init__(self, problems: list[Problem]) -> None:
        super().__init__("\n".join(str(problem) for problem in problems))
        self.problems = tuple(problems)


@dataclass(slots=True)
class ProblemList:
    """Collects problems, so that a pupil sees all of them at once."""

    found: list[Problem] = field(default_factory=list)

    def add(self, place: Place, text: str) -> None:
        """Note a problem."""
        self.found.append(Problem(place, text))

    def raise_if_any(self) -> None:
        """Stop if anything was found, in order of file and line.

        Raises:
            MissionError: with all problems.
        """
        if self.found:
            raise MissionError(sorted(set(self.found), key=lambda p: (p.place.file, p.place.line, p.text)))
