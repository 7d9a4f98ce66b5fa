"""What the referee tells: single crossings, how a try stands, and its result."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from scenarios.crossing import Side
from scenarios.verdict import Verdict


@dataclass(frozen=True, slots=True)
class Crossing:
    """The first passage through a frame.

    Attributes:
        colour: the frame.
        time_s: since motors on.
        offset_m: distance of the drone's centre from the opening's centre, in the frame's plane.
        side: the side it came from; "front" is where the frame's normal points.
    """

    colour: str
    time_s: float
    offset_m: float
    side: Side


@dataclass(frozen=True, slots=True)
class RefereeSnapshot:
    """How the try stands now, for displays.

    Attributes:
        began_us: vehicle time of motors on, microseconds; None before.
        try_time_s: since motors on; stands still after motors off.
        penalty_s: so far.
        crossed: colours crossed so far.
        next_colour: the frame whose turn it is; None when all are crossed.
        contacts: contacts with frames so far.
        inside: whether the drone is inside the arena.
        motors_on: whether the try is being flown.
        settled: motors off and at rest.
        over: nothing that comes can change the verdict.
    """

    began_us: int | None
    try_time_s: float
    penalty_s: float
    crossed: tuple[str, ...]
    next_colour: str | None
    contacts: int
    inside: bool
    motors_on: bool
    settled: bool
    over: bool


@dataclass(frozen=True, slots=True)
class RefereeReport:
    """The result of a try; its fields stand in `result.json` under the same names.

    Attributes:
        verdict: see `judge`.
        reason: one sentence with the mission's state.
        frames_crossed: colours in order of their first crossing, wrong ones included.
        crossing_times_s: since motors on, one for each of `frames_crossed`.
        crossing_offsets_m: from the opening's centre, in its plane, one for each.
        crossing_sides: "front" or "back", the side it came from, one for each.
        contacts: number of contacts with frames.
        contact_frames: the frame of each contact, in order.
        outside_s: time outside the arena with motors on.
        try_time_s: from motors on to motors off (or to the end of the watch, at most the limit).
        penalty_s: one second for each second outside.
        total_time_s: try time and penalty.
        landed_on_base: standing on the base, motors off.
        landing_error_m: plan distance from the base's centre; None when it did not land.
        path_length_m: flown with motors on.
        ignored_states: states that were not finite or went back in time.
        longest_gap_s: longest time between two states of the try.
    """

    verdict: Verdict
    reason: str
    frames_crossed: tuple[str, ...]
    crossing_times_s: tuple[float, ...]
    crossing_offsets_m: tuple[float, ...]
    crossing_sides: tuple[Side, ...]
    contacts: int
    contact_frames: tuple[str, ...]
    outside_s: float
    try_time_s: float
    penalty_s: float
    total_time_s: float
    landed_on_base: bool
    landing_error_m: float | None
    path_length_m: float
    ignored_states: int
    longest_gap_s: float

    def as_dict(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {**asdict(self), "verdict": str(self.verdict)}
