"""Why a flight was not clean, in one line: what happened, when, where, and what the navigator knew then."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import degrees, dist, hypot, pi, remainder

from framerunner.runs.track import Track
from offboard.app import MissionEnd, Moment
from offboard.navigation.view import GateEstimate, NavigationView
from offboard.safety.operator import STOPPED
from scenarios.crossing import Boundary
from scenarios.models import COLOURS, Scenario, UprightGate
from scenarios.result import FlightResult, RefereeReport
from scenarios.verdict import Verdict

SAME_GATE_M = 1.0  # an estimate of a gate's colour that is farther away is of something else
PLACE_OFF_M = 0.05  # a place that is off by less is no cause


@dataclass(frozen=True, slots=True)
class Flown:
    """What is known of a flight that is over.

    Attributes:
        layout: the gates and obstacles where they truly were.
        report: of the referee.
        end: how the mission ended.
        track: its times count from motors on; with the true path, if that is known.
        began_us: vehicle time of motors on; None if they never were.
    """

    layout: Scenario
    report: RefereeReport
    end: MissionEnd
    track: Track
    began_us: int | None


class CauseWatch:
    """Remembers what the navigator knew during a flight."""

    def __init__(self) -> None:
        self._views: list[tuple[int, NavigationView]] = []  # vehicle time; without paths
        self._latest: NavigationView | None = None

    def see(self, moment: Moment) -> None:
        """Take a tick."""
        view = moment.navigation
        if view is not None and view is not self._latest:
            self._latest = view
            self._views.append((moment.state.time_us, replace(view, path_m=())))

    def words(self, flown: Flown) -> str:
        """Why the flight was not clean, or its mission was broken off, in one line; else empty."""
        report, track = flown.report, flown.track
        parts = [self._contact(flown), _outside(flown)]
        if report.verdict is Verdict.WRONG_ORDER:
            parts.append(_wrong_order(flown))
        elif report.verdict is Verdict.CRASHED:
            parts.append(f"crashed {_at(track, report.try_time_s)}{_place_off(track, report.try_time_s)}")
            if flown.end.reason.startswith(STOPPED):  # other reasons follow from the crash
                parts.append(flown.end.reason)
        elif report.completed and flown.end.ended == "aborted":  # it could land as it should, all the same
            parts.append(f"the mission was broken off: {_end(flown)}")
        elif not report.completed:
            parts.append(_end(flown))
            parts.append(self._hindrance(flown))
        return "; ".join(part for part in parts if part)

    def false_gates(self, flown: Flown) -> int | None:
        """How many places the map had a certain gate at where no gate or decoy is; None without a map.

        A place is farther than `SAME_GATE_M` from each gate of its colour, as estimated and also after what
        the drone's place was off by has been subtracted. Places of a colour nearer to each other are one.
        """
        if not self._views:
            return None
        found: list[GateEstimate] = []
        for time_us, view in self._views:
            for estimate in view.gates:
                known: tuple[GateEstimate | UprightGate, ...] = (*flown.layout.all_gates, *found)
                if estimate.certain and not _is_at(estimate, estimate.position_m, known):
                    time_s = (time_us - (flown.began_us or 0)) / 1e6
                    error_m = flown.track.place_error_m(time_s) or (0.0, 0.0, 0.0)
                    corrected = [at - error for at, error in zip(estimate.position_m, error_m, strict=True)]
                    if not _is_at(estimate, corrected, flown.layout.all_gates):
                        found.append(estimate)
        return len(found)

    def _contact(self, flown: Flown) -> str:
        """The first contact, and how exact the map was then."""
        report = flown.report
        if not report.contact_frames:
            return ""
        name, *others = report.contact_frames
        if not report.contact_times_s:
            return f"touched {name}"
        time_s = report.contact_times_s[0]
        more = (
            f", then {len(others)} more contacts" if len(others) > 1 else ", then one more" if others else ""
        )
        gate = next((gate for gate in flown.layout.frames if gate.colour == name), None)
        known = "" if gate is None else self._error_of_map(gate, time_s, flown)
        off = known or _place_off(flown.track, time_s)
        return f"touched {name} {_at(flown.track, time_s)}{off}{more}"

    def _error_of_map(self, gate: UprightGate, time_s: float, flown: Flown) -> str:
        """How far the navigator's estimate of a gate was off at a time.

        If the drone's place was off, the gate's is told from there: that error is common to both.
        """
        began_us, error_m = flown.began_us, flown.track.place_error_m(time_s)
        if began_us is None or not self._views:
            return ""
        number = bisect_right(self._views, began_us + round(time_s * 1e6), key=lambda seen: seen[0])
        estimates = self._views[max(number - 1, 0)][1].gates
        own = [estimate for estimate in estimates if estimate.colour == gate.colour]
        true_m = gate.position_arena_m
        nearest = min(own, key=lambda estimate: dist(estimate.position_m, true_m), default=None)
        if nearest is None or dist(nearest.position_m, true_m) > SAME_GATE_M:
            return ", which was not on the map"
        off_deg = degrees(abs(remainder(nearest.yaw_rad - gate.yaw_rad, pi)))
        off_m = [believed - true for believed, true in zip(nearest.position_m, true_m, strict=True)]
        if error_m is None or hypot(*error_m) < PLACE_OFF_M:
            return f", which the map had {100 * hypot(*off_m):.1f} cm and {off_deg:.1f}° off"
        from_drone_cm = 100 * dist(off_m, error_m)
        return (
            f"{_place_off(flown.track, time_s)}, and from there the map had {gate.colour} "
            f"{from_drone_cm:.1f} cm and {off_deg:.1f}° off"
        )

    def _hindrance(self, flown: Flown) -> str:
        """What the navigator lacked to cross the next gate or to fly home."""
        if not self._views:
            return ""
        crossed = flown.report.frames_crossed
        wanted = [gate.colour for gate in flown.layout.frames if gate.colour not in crossed]
        troubles = [view.trouble for _, view in self._views]
        began = [now for now, before in zip(troubles, ["", *troubles], strict=False) if now and now != before]
        last = began[-1] if began else ""
        times = f" ({len(began)} times in trouble)" if len(began) > 1 else ""
        words = f"last trouble of the navigator: {last}{times}" if last else ""
        if not wanted:
            return words
        colour = min(wanted, key=COLOURS.index)
        if not any(seen.colour == colour for _, view in self._views for seen in view.gates):
            return f"{colour} was never on the map"
        return words


def _is_at(
    estimate: GateEstimate, place_m: Sequence[float], gates: Sequence[GateEstimate | UprightGate]
) -> bool:
    """Whether a place, in the arena's axes, is that of one of the gates of an estimate's colour."""
    own = (gate for gate in gates if gate.colour == estimate.colour)
    return any(dist(_position_m(gate), place_m) <= SAME_GATE_M for gate in own)


def _position_m(gate: GateEstimate | UprightGate) -> Sequence[float]:
    return gate.position_arena_m if isinstance(gate, UprightGate) else gate.position_m


def lost_in(result: FlightResult, track: Track) -> str:
    """The mission's state in which a flight was lost or, if it was completed, in which it touched something.

    Returns:
        "" of a clean flight, and where it is not known.
    """
    if result.verdict is Verdict.CRASHED:
        return _state_at(track, result.try_time_s)
    if not result.completed:
        return result.mission_state
    return _state_at(track, result.contact_times_s[0]) if result.contact_times_s else ""


def _outside(flown: Flown) -> str:
    """Where the drone first left the arena."""
    if not flown.report.outside_s:
        return ""
    track, boundary = flown.track, Boundary(flown.layout.arena)
    flown_path = track.as_flown().reported_path
    left_s = next(
        (
            time_s
            for time_s, *place_m in flown_path
            if boundary.margin((place_m[0], place_m[1], place_m[2])) < 0.0
        ),
        None,
    )
    where = "" if left_s is None else f", first {_at(track, left_s)}{_place_off(track, left_s)}"
    return f"outside the arena for {flown.report.outside_s:.2f} s{where}"


def _wrong_order(flown: Flown) -> str:
    """The first gate that was crossed too early."""
    report = flown.report
    order = [colour for colour in COLOURS if any(gate.colour == colour for gate in flown.layout.frames)]
    for wanted, colour, time_s in zip(order, report.frames_crossed, report.crossing_times_s, strict=False):
        if colour != wanted:
            return f"crossed {colour} before {wanted} {_at(flown.track, time_s)}"
    return ""


def _end(flown: Flown) -> str:
    """How the mission ended, and where."""
    end, track = flown.end, flown.track
    if end.ended == "aborted":
        return " ".join(end.reason.split())
    if not len(track):
        return end.reason
    state, last_s = track.mission_state[-1], track.time_s[-1]
    index = len(track) - 1
    while index > 0 and track.mission_state[index - 1] == state:
        index -= 1
    if end.ended == "timed out":
        return f"in {state} for the last {last_s - track.time_s[index]:.0f} s"
    return f"the mission ended {_at(track, last_s)}{_place_off(track, last_s)}"


def _at(track: Track, time_s: float) -> str:
    """When, in which state and where."""
    words = f"at {time_s:.1f} s"
    if not len(track):
        return words
    index = _index_at(track, time_s)
    state = f" in {track.mission_state[index]}" if track.mission_state[index] else ""
    flown = track.as_flown()
    x, y, z = flown.x[index], flown.y[index], flown.z[index]
    return f"{words}{state} at ({x:.2f}, {y:.2f}, {z:.2f})"


def _place_off(track: Track, time_s: float) -> str:
    """How far the place was off by which the drone was flown; empty if little, or not known."""
    error_m = track.place_error_m(time_s)
    if error_m is None or hypot(*error_m) < PLACE_OFF_M:
        return ""
    return f", the place being off by {100 * hypot(*error_m):.0f} cm"


def _state_at(track: Track, time_s: float) -> str:
    return track.mission_state[_index_at(track, time_s)] if len(track) else ""


def _index_at(track: Track, time_s: float) -> int:
    """The last sample until a time, or the first one."""
    return min(max(bisect_right(track.time_s, time_s) - 1, 0), len(track) - 1)
