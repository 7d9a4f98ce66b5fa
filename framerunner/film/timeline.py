"""The timeline of a film: what is shown at each time of a flight."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, pi

import numpy as np
import numpy.typing as npt

from framerunner.recording.collected import CollectedFlight
from framerunner.recording.events import RecordingError
from offboard.app import Moment
from scenarios.models import Scenario
from scenarios.result import FlightResult
from vision.types import Detections, Image

Floats = npt.NDArray[np.float64]

LEAD_IN_S = 1.0
"""Shown before motors on."""
_MOVED_M = 0.015  # between two points of the trail, at least, within one state
_FAR_OUTSIDE_M = 1000.0


@dataclass(frozen=True, slots=True)
class Instant:
    """What is shown at one time.

    Attributes:
        time_s: since motors on.
        position_arena_m: shape (3,).
        yaw_rad: heading, counter-clockwise from x.
        motors_on: whether the rotors turn.
        state: of the mission, such as "red.turning"; "" if there is none.
        kind: number of the kind of state, see `Timeline.kinds`.
        detections: of the image shown.
        image: index of the camera's image; None before the first.
        crossed: when each colour was crossed so far, seconds since motors on.
        trail: number of the trail's points that the drone has passed.
    """

    time_s: float
    position_arena_m: tuple[float, float, float]
    yaw_rad: float
    motors_on: bool
    state: str
    kind: int
    detections: Detections
    image: int | None
    crossed: Mapping[str, float]
    trail: int


class Timeline:
    """A flight, of which any time can be shown in any order.

    Args:
        flight: all that was recorded of it.
        scenario: where it was flown, with the gates' real heights.

    Raises:
        RecordingError: no moment has a position.

    Attributes:
        scenario: see above.
        title: of the film.
        mission: its name; "" if unknown.
        begin_s: the first time to show, seconds since motors on.
        end_s: the last.
        try_end_s: when the try ended; None if it was not judged.
        result: None if the flight was not judged.
        kinds: last parts of the states' ids, in order of first appearance.
        trail_m: path of the drone, arena metres, shape (n, 3).
        trail_kind: the kind of state at each of its points, shape (n,).
        stretches: (from, to, kind) of the whole film, seconds, without gaps.
    """

    def __init__(self, flight: CollectedFlight, scenario: Scenario) -> None:
        self.scenario = scenario
        self._flight = flight
        self._moments = [moment for moment in flight.moments if _is_drawable(moment)]
        if not self._moments:
            raise RecordingError(f"film: {flight.title}: has no position; nothing can be shown")
        self._times_s = [self._seconds(moment.state.time_us) for moment in self._moments]
        self._crossings = [(self._seconds(each.time_us), each.colour) for each in flight.crossings]
        self.result: FlightResult | None = flight.result
        self.title = scenario.name
        self.mission = "" if self.result is None else self.result.mission[:60]
        self.try_end_s = None if self.result is None else self.result.try_time_s
        self.begin_s = max(self._times_s[0], -LEAD_IN_S)
        self.end_s = max(self._times_s[-1], self.begin_s + 0.1)
        names = [moment.mission_state.rpartition(".")[2] for moment in self._moments]
        self.kinds = list(dict.fromkeys(names))
        self._moment_kinds = [self.kinds.index(name) for name in names]
        self._find_trail()
        self.stretches = self._find_stretches()

    def image(self, index: int) -> Image:
        """An image of the camera, BGR, shape (height, width, 3)."""
        return self._flight.images.image(index)

    def at(self, time_s: float) -> Instant:
        """What is shown at a time, seconds since motors on; before and after the flight nothing moves."""
        number = max(0, bisect_right(self._times_s, time_s) - 1)
        following = min(number + 1, len(self._moments) - 1)
        here, after = self._moments[number], self._moments[following]
        span_s = self._times_s[following] - self._times_s[number]
        part = min(1.0, max(0.0, (time_s - self._times_s[number]) / span_s)) if span_s > 0 else 0.0
        a, b = here.state, after.state
        turn = (b.yaw - a.yaw + pi) % (2 * pi) - pi
        time_us = self._flight.began_us + round(time_s * 1e6)
        return Instant(
            time_s,
            (a.x + part * (b.x - a.x), a.y + part * (b.y - a.y), a.z + part * (b.z - a.z)),
            a.yaw + part * turn,
            a.armed,
            here.mission_state,
            self._moment_kinds[number],
            here.detections,
            self._flight.images.latest_at(time_us),
            {colour: when_s for when_s, colour in self._crossings if when_s <= time_s},
            bisect_right(self._trail_s, time_s),
        )

    def mean_position(self, time_s: float, around_s: float) -> Floats:
        """Mean position from `around_s` before a time to `around_s` after it, metres, shape (3,)."""
        times_s = time_s + np.linspace(-around_s, around_s, 15)
        mean: Floats = np.mean([self.at(float(each)).position_arena_m for each in times_s], axis=0)
        return mean

    def _seconds(self, time_us: int) -> float:
        return (time_us - self._flight.began_us) / 1e6

    def _find_trail(self) -> None:
        points: list[tuple[float, float, float]] = []
        self._trail_s: list[float] = []
        kinds: list[int] = []
        for moment, time_s, kind in zip(self._moments, self._times_s, self._moment_kinds, strict=True):
            position = (moment.state.x, moment.state.y, moment.state.z)
            moved = (
                not points or max(abs(a - b) for a, b in zip(position, points[-1], strict=True)) > _MOVED_M
            )
            if moved or kind != kinds[-1]:
                points.append(position)
                kinds.append(kind)
                self._trail_s.append(time_s)
        self.trail_m: Floats = np.array(points).reshape(-1, 3)
        self.trail_kind = np.array(kinds, np.int32)

    def _find_stretches(self) -> list[tuple[float, float, int]]:
        kinds = self._moment_kinds
        firsts = [i for i in range(len(kinds)) if i == 0 or kinds[i] != kinds[i - 1]]
        starts_s = [self.begin_s, *(max(self.begin_s, self._times_s[i]) for i in firsts[1:])]
        ends_s = [*starts_s[1:], self.end_s]
        return list(zip(starts_s, ends_s, (kinds[i] for i in firsts), strict=True))


def _is_drawable(moment: Moment) -> bool:
    """Whether its pose is finite and near the arena; a damaged log may have any numbers."""
    state = moment.state
    values = (state.x, state.y, state.z, state.yaw)
    return all(isfinite(value) and abs(value) < _FAR_OUTSIDE_M for value in values)
