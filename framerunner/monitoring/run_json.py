"""A recorded flight as the monitor's replay reads it; see `docs/monitor-channels.md`, section 5."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import cos, isfinite, pi, sin
from typing import Any

from framerunner.recording.collected import CollectedFlight
from geometry.rotations import quaternion_from_yaw
from offboard.app import Moment
from offboard.engine import TransitionTaken
from offboard.mission import Mission, mermaid
from scenarios.models import COLOURS, Scenario
from vision.types import Detection, Detections

Json = dict[str, Any]

_LONGEST_TEXT = 500


@dataclass(frozen=True, slots=True)
class FlownMission:
    """What flew.

    Attributes:
        mission: loaded.
        source: text of its file.
    """

    mission: Mission
    source: str


def flight_json(
    name: str,
    flight: CollectedFlight,
    scenario: Scenario | None,
    flown: FlownMission | None,
    size_px: tuple[int, int],
) -> Json:
    """All of a flight but its images.

    Args:
        name: of the run.
        flight: what was recorded.
        scenario: where it was flown, if that is known.
        flown: its mission, if it can be drawn.
        size_px: width and height of its images.
    """
    result = flight.result
    states = _states(flight, flown)
    numbers = {state: number for number, state in enumerate(states)}
    clock = _Clock(flight.began_us)
    return {
        "name": name,
        "world": {
            "scenario": None if scenario is None else scenario.model_dump(mode="json"),
            "lift_m": 0.0 if result is None else result.lift_m,
            "source": "" if result is None else result.judged_by,
        },
        "chart": _chart(flown),
        "states": states,
        "poses": _poses(flight, numbers, clock),
        "detections": _detections(flight.moments, clock, size_px),
        "transitions": _transitions(flight, clock, flown),
        "images": [clock.seconds(time_us) for time_us in flight.images.time_us],
        "crossings": [{"t": clock.seconds(each.time_us), "colour": each.colour} for each in flight.crossings],
        "result": None if result is None else result.as_json(),
    }


@dataclass(frozen=True, slots=True)
class _Clock:
    began_us: int

    def seconds(self, time_us: int) -> float:
        """Seconds since motors on, to the millisecond."""
        return round((time_us - self.began_us) / 1e6, 3)


def _states(flight: CollectedFlight, flown: FlownMission | None) -> list[str]:
    """The mission's states and, behind them, whatever else was told: a log knows flight modes instead."""
    states = [] if flown is None else list(flown.mission.leaves)
    told = dict.fromkeys(moment.mission_state for moment in flight.moments if moment.mission_state)
    return states + [state for state in told if state not in states]


def _chart(flown: FlownMission | None) -> Json | None:
    if flown is None:
        return None
    mission = flown.mission
    return {
        "name": mission.name,
        "mermaid": mermaid(mission),
        "states": list(mission.leaves),
        "source": flown.source,
    }


def _poses(flight: CollectedFlight, numbers: Mapping[str, int], clock: _Clock) -> list[Json]:
    moments = [moment for moment in flight.moments if _is_placed(moment)]
    poses: list[Json] = []
    for number, moment in enumerate(moments):
        before, after = moments[max(0, number - 1)], moments[min(number + 1, len(moments) - 1)]
        span_s = (after.state.time_us - before.state.time_us) / 1e6
        turn_rad = (after.state.yaw - before.state.yaw + pi) % (2 * pi) - pi
        state, command = moment.state, moment.command
        c, s = cos(state.yaw), sin(state.yaw)
        vx, vy, vz = state.velocity_arena_m_s
        told = (command.forward_m_s, command.left_m_s, command.up_m_s, command.yaw_rate_rad_s)
        poses.append(
            {
                "t": clock.seconds(state.time_us),
                "p": _rounded(state.x, state.y, state.z),
                "q": _rounded(*quaternion_from_yaw(state.yaw)),
                "v": _rounded(c * vx + s * vy, c * vy - s * vx, vz),
                "r": _rounded(turn_rad / span_s if span_s > 0 else 0.0)[0],
                "c": _rounded(*told) if flight.mission_is_known else None,
                "on": state.armed,
                "s": numbers.get(moment.mission_state, -1),
            }
        )
    return poses


def _is_placed(moment: Moment) -> bool:
    state = moment.state
    return all(map(isfinite, (state.x, state.y, state.z, state.yaw)))


def _detections(moments: Sequence[Moment], clock: _Clock, size_px: tuple[int, int]) -> list[Json]:
    found: list[Json] = []
    last: Detections | None = None
    for moment in moments:
        seen = moment.detections
        if seen == last:
            continue
        last = seen
        time_us = moment.state.time_us if seen.time_us is None else seen.time_us
        boxes = {colour: _box(getattr(seen, colour)) for colour in COLOURS}
        at_s = clock.seconds(time_us)
        if not found or found[-1]["t"] <= at_s:
            found.append({"t": at_s, "width": size_px[0], "height": size_px[1], "boxes": boxes})
    return found


def _box(detection: Detection) -> list[float | None] | None:
    if not detection.seen:
        return None
    return _rounded(detection.n, detection.s, detection.e, detection.w, detection.d, detection.a)


def _transitions(flight: CollectedFlight, clock: _Clock, flown: FlownMission | None) -> list[Json]:
    """As the engine told them or, in older recordings and logs, from the states alone."""
    found: list[Json] = []
    state, since_us = flight.moments[0].mission_state, flight.moments[0].state.time_us
    for moment in flight.moments:
        now_us = moment.state.time_us
        taken = moment.transition
        if taken is None and moment.mission_state == state:
            continue
        if taken is None:
            when = _guard(flown, state, moment.mission_state)
            taken = TransitionTaken(state, moment.mission_state, when, (), now_us, (now_us - since_us) / 1e6)
        found.append(
            {
                "time_s": clock.seconds(now_us),
                "from": taken.source[:_LONGEST_TEXT],
                "to": taken.target[:_LONGEST_TEXT],
                "when": taken.when[:_LONGEST_TEXT],
                "values": [[name[:_LONGEST_TEXT], _plain(value)] for name, value in taken.values],
                "seconds": round(taken.seconds_in_source, 3),
            }
        )
        state, since_us = moment.mission_state, now_us
    return found


def _guard(flown: FlownMission | None, source: str, target: str) -> str:
    """The guard between two states, where the chart leaves no doubt which it was."""
    leaf = None if flown is None else flown.mission.leaves.get(source)
    if leaf is None:
        return ""
    guards = {each.when for each in leaf.transitions if target == each.to or target.startswith(f"{each.to}.")}
    return guards.pop() if len(guards) == 1 else ""


def _plain(value: object) -> object:
    if isinstance(value, float):
        return value if isfinite(value) else None
    return value if value is None or isinstance(value, bool | int) else str(value)[:_LONGEST_TEXT]


def _rounded(*values: float) -> list[float | None]:
    """To a tenth of a millimetre, which is enough to look at; what is not finite is null."""
    return [round(value, 4) if isfinite(value) else None for value in values]
