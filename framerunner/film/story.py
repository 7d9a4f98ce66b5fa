"""A flight as a film tells it: what is to be seen at any time of it. Pure data, no pictures."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, isfinite, pi, sin

import numpy as np
import numpy.typing as npt

from framerunner.recording.collected import CollectedFlight
from framerunner.recording.events import RecordingError
from offboard.app import Moment
from scenarios.models import Scenario
from scenarios.result import FlightResult
from vision.types import Detections

Floats = npt.NDArray[np.float64]

LEAD_IN_S = 1.0
"""Shown before the motors go on."""
_MOVED_M = 0.015  # the trail has no more points than are seen
_FAR_OUTSIDE_M = 1000.0


@dataclass(frozen=True, slots=True)
class Instant:
    """What is to be seen at one time.

    Attributes:
        time_s: since motors on.
        position_arena_m: shape (3,).
        yaw_rad: heading, counter-clockwise from x.
        motors_on: whether the rotors turn.
        state: of the mission, such as "red.turning"; "" if there is none.
        kind: which kind of state it is, numbered as they first appear.
        detections: of the image shown.
        image: which image is shown; None before the first.
        crossed: when each colour was crossed so far, seconds since motors on.
        trail: how many points of the story's trail are behind the drone.
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


class Story:
    """A flight, to be looked at in any order.

    Args:
        flight: all that was recorded of it.
        scenario: where it was flown, its frames as high as they hung.

    Raises:
        RecordingError: the drone's place is never known.

    Attributes:
        scenario: see above.
        title: of the film.
        mission: its name; "" if unknown.
        begin_s: the first time to show, seconds since motors on.
        end_s: the last.
        try_end_s: when the try's clock stopped; None if nobody judged.
        result: None if the flight was not judged.
        kinds: last parts of the states' ids, in order of first appearance.
        trail_m: places flown through, arena metres, shape (n, 3).
        trail_kind: the kind of state of each, shape (n,).
        stretches: (from, to, kind) of the whole film, seconds, one after another.
    """

    def __init__(self, flight: CollectedFlight, scenario: Scenario) -> None:
        self.scenario = scenario
        self._flight = flight
        drawable = [moment for moment in flight.moments if _has_place(moment)]
        if not drawable:
            raise RecordingError(f"film: {flight.title}: no moment of it has a place; nothing can be shown")
        self._moments = drawable
        self._times_s = [self._seconds(moment.state.time_us) for moment in self._moments]
        self._crossings = [(self._seconds(each.time_us), each.colour) for each in flight.crossings]
        self.result: FlightResult | None = flight.result
        self.title = scenario.name
        self.mission = "" if self.result is None else self.result.mission[:60]
        self.try_end_s = None if self.result is None else self.result.try_time_s
        self.begin_s = max(self._times_s[0], -LEAD_IN_S)
        self.end_s = max(self._times_s[-1], self.begin_s + 0.1)
        self.kinds: list[str] = []
        kinds = [self._kind(moment.mission_state) for moment in self._moments]
        self._kinds = kinds
        self._trail(kinds)
        self.stretches = self._stretches(kinds)

    @property
    def images(self) -> int:
        """How many images there are."""
        return len(self._flight.images)

    def image(self, index: int) -> npt.NDArray[np.uint8]:
        """An image, BGR, shape (height, width, 3)."""
        return self._flight.images.image(index)

    def at(self, time_s: float) -> Instant:
        """What is to be seen at a time, seconds since motors on; before and after, all stands still."""
        number = max(0, bisect_right(self._times_s, time_s) - 1)
        here = self._moments[number]
        after = self._moments[min(number + 1, len(self._moments) - 1)]
        span_s = self._times_s[min(number + 1, len(self._moments) - 1)] - self._times_s[number]
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
            self._kinds[number],
            here.detections,
            self._flight.images.latest_at(time_us),
            {colour: when_s for when_s, colour in self._crossings if when_s <= time_s},
            bisect_right(self._trail_s, time_s),
        )

    def mean_position(self, time_s: float, around_s: float) -> Floats:
        """Where the drone is on average from some time before to as long after, metres, shape (3,)."""
        times_s = time_s + np.linspace(-around_s, around_s, 15)
        places = np.array([self.at(float(each)).position_arena_m for each in times_s])
        mean: Floats = places.mean(axis=0)
        return mean

    def _seconds(self, time_us: int) -> float:
        return (time_us - self._flight.began_us) / 1e6

    def _kind(self, state: str) -> int:
        kind = state.rpartition(".")[2]
        if kind not in self.kinds:
            self.kinds.append(kind)
        return self.kinds.index(kind)

    def _trail(self, kinds: list[int]) -> None:
        points: list[tuple[float, float, float]] = []
        self._trail_s: list[float] = []
        kept: list[int] = []
        for moment, time_s, kind in zip(self._moments, self._times_s, kinds, strict=True):
            place = (moment.state.x, moment.state.y, moment.state.z)
            moved = not points or max(abs(a - b) for a, b in zip(place, points[-1], strict=True)) > _MOVED_M
            if moved or kind != kept[-1]:
                points.append(place)
                kept.append(kind)
                self._trail_s.append(time_s)
        self.trail_m: Floats = np.array(points).reshape(-1, 3)
        self.trail_kind = np.array(kept, np.int32)

    def _stretches(self, kinds: list[int]) -> list[tuple[float, float, int]]:
        found: list[tuple[float, float, int]] = []
        since_s = self.begin_s
        for i, kind in enumerate(kinds):
            last = i + 1 == len(kinds)
            if last or kinds[i + 1] != kind:
                until_s = self.end_s if last else max(since_s, self._times_s[i + 1])
                found.append((since_s, until_s, kind))
                since_s = until_s
        return found


def _has_place(moment: Moment) -> bool:
    """Whether it can be drawn; a value out of a damaged log must not blow up the view."""
    state = moment.state
    values = (state.x, state.y, state.z, state.yaw)
    return all(isfinite(value) and abs(value) < _FAR_OUTSIDE_M for value in values)


def level_attitude(yaw_rad: float) -> tuple[Floats, Floats, Floats]:
    """Forward, left and up of a drone that flies level, arena axes, unit vectors."""
    c, s = cos(yaw_rad), sin(yaw_rad)
    return np.array((c, s, 0.0)), np.array((-s, c, 0.0)), np.array((0.0, 0.0, 1.0))
