"""Pictures for people: a scenario from above, and where a flight went.

Drawing itself is in `framerunner.drawing`, imported only when a picture is made: matplotlib takes a second.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from errors import UserError
from geometry.vectors import Vec3
from scenarios.models import Scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")


class PictureError(UserError):
    """A picture that cannot be made; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class Track:
    """Where a drone was; all sequences have the same length.

    Attributes:
        time_s: since motors on, not decreasing, shape (n,).
        x: arena metres, shape (n,); a sample that is not finite leaves a gap in the drawn path.
        y: see x.
        z: see x.
        mission_state: the state's id at each sample, such as "red.turning"; "" where there is none.
    """

    time_s: Sequence[float] = ()
    x: Sequence[float] = ()
    y: Sequence[float] = ()
    z: Sequence[float] = ()
    mission_state: Sequence[str] = ()

    def __post_init__(self) -> None:
        """Refuse sequences of different lengths.

        Raises:
            ValueError: they differ.
        """
        lengths = {name: len(getattr(self, name)) for name in ("time_s", "x", "y", "z", "mission_state")}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"a track's sequences must have one length, not {lengths}")

    def __len__(self) -> int:
        """Number of samples."""
        return len(self.time_s)

    def is_drawable(self, index: int) -> bool:
        """Whether a sample has a place."""
        return isfinite(self.x[index]) and isfinite(self.y[index]) and isfinite(self.z[index])

    def place_at(self, time_s: float) -> Vec3 | None:
        """Where the drone was at a time, on the straight line between the samples around it.

        Returns:
            Arena metres, shape (3,); None before the first and after the last sample that has a place.
        """
        known = [i for i in range(len(self)) if self.is_drawable(i)]
        for i, j in zip(known, known[1:] or known, strict=False):
            if not self.time_s[i] <= time_s <= self.time_s[j]:
                continue
            span_s = self.time_s[j] - self.time_s[i]
            part = (time_s - self.time_s[i]) / span_s if span_s > 0 else 0.0
            x, y, z = (values[i] + part * (values[j] - values[i]) for values in (self.x, self.y, self.z))
            return (x, y, z)
        return None

    def stretches(self) -> Iterator[tuple[str, range]]:
        """Stretches flown in one kind of state, in order of time.

        The kind is the last part of the state's id: the drone turns for green as it does for red, and a dozen
        colours can be told apart, three dozen cannot. Each stretch reaches to the first sample of the next.
        """
        kinds = (state.rpartition(".")[2] for state in self.mission_state)
        for kind, group in groupby(enumerate(kinds), key=lambda pair: pair[1]):
            indices = [index for index, _ in group]
            yield kind, range(indices[0], min(indices[-1] + 2, len(self)))

    def seconds_in_state(self) -> dict[str, float]:
        """Time spent in each kind of state, seconds, in order of first appearance."""
        spent_s: dict[str, float] = {}
        for kind, indices in self.stretches():
            duration_s = self.time_s[indices[-1]] - self.time_s[indices[0]]
            spent_s[kind] = spent_s.get(kind, 0.0) + duration_s
        return spent_s


@dataclass(frozen=True, slots=True)
class Outcome:
    """What the referee said of a flight.

    Attributes:
        verdict: one word or two.
        reason: one sentence; may be empty.
        try_time_s: motors on to motors off.
        penalty_s: for time outside the arena.
        crossing_times_s: since motors on, by the frame's colour.
    """

    verdict: str
    reason: str = ""
    try_time_s: float = 0.0
    penalty_s: float = 0.0
    crossing_times_s: Mapping[str, float] | None = None

    @classmethod
    def from_result(cls, result: Mapping[str, Any]) -> Outcome:
        """Read it from the content of `result.json`."""
        times = zip(result["frames_crossed"], result["crossing_times_s"], strict=True)
        return cls(
            verdict=str(result["verdict"]),
            reason=str(result["reason"]),
            try_time_s=float(result["try_time_s"]),
            penalty_s=float(result["penalty_s"]),
            crossing_times_s={str(colour): float(time_s) for colour, time_s in times},
        )


def scenario_picture(scenario: Scenario, path: Path) -> None:
    """Draw a scenario from above and from the side: floor, base, start and frames with their heights.

    Args:
        scenario: what to draw.
        path: the file to write; its suffix, one of `SUFFIXES`, says the format.

    Raises:
        PictureError: the suffix is not known, or the file cannot be written.
    """
    _check_suffix(path)
    from framerunner.drawing import draw_scenario

    _save(draw_scenario(scenario), path)


def track_picture(scenario: Scenario, track: Track, outcome: Outcome | None, path: Path) -> None:
    """Draw a flight from above and from the side, its path coloured by the mission's state.

    Args:
        scenario: what was flown.
        track: where the drone was; may be empty.
        outcome: what the referee said; None if there was no referee.
        path: the file to write; its suffix, one of `SUFFIXES`, says the format.

    Raises:
        PictureError: the suffix is not known, or the file cannot be written.
    """
    _check_suffix(path)
    from framerunner.drawing import draw_track

    _save(draw_track(scenario, track, outcome), path)


def _check_suffix(path: Path) -> None:
    if path.suffix.lower() not in SUFFIXES:
        raise PictureError(f"picture: '{path}' has no known format; name it {', '.join(SUFFIXES)}")


def _save(figure: Figure, path: Path) -> None:
    try:
        figure.savefig(path)
    except OSError as error:
        raise PictureError(f"picture: cannot write '{path}': {error.strerror or error}") from error
