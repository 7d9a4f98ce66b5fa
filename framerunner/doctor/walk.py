"""A walk with the drone in the hands: whether its optical flow and range finder see this floor well enough.

The drone stands on a mark, is carried about as it will fly, and is put back on the mark. What it then reports
to have moved is the drift of its estimate. Nothing is armed and no parameter is set; messages are asked for
at higher rates on this link.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby, pairwise
from math import degrees, dist, hypot, isfinite, pi, remainder, sqrt
from statistics import fmean, median

from framerunner.wire.dialect import Message, mavlink, request_rate
from framerunner.wire.session.client import VehicleClient
from framerunner.wire.session.record import Record
from offboard.safety.check import Check, Checks, good, missing, note

WALK_SUBJECTS = ("flow", "range", "walk", "drift", "heading")
STAND_S = 6.0  # on the mark, before and after the walk
_LAST_S = 3.0  # of standing, in which a pose counts: somebody has just put it there
_RATES_HZ = {
    mavlink.MAVLINK_MSG_ID_OPTICAL_FLOW_RAD: 20.0,
    mavlink.MAVLINK_MSG_ID_DISTANCE_SENSOR: 20.0,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: 20.0,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: 20.0,
}
_LEAST_FLOW_HZ = 5.0
_BAD_SHARE, _WORST_SHARE = 0.15, 0.4  # of the flow's samples
_BAD_RANGE_SHARE = 0.1
_NEEDED_RANGE_M = 2.5  # above the floor: the highest path over gates at 2 m
_WALKED_M = 2.0
# The drift of a position by optical flow grows with the root of the time. The simulated suite `flow`, with
# which the app finds its way, drifts by 7 cm after a second in plan, a genuine PX4 with it by up to 17.
_GOOD_DRIFT_M, _MOST_DRIFT_M = 0.18, 0.36  # after a second
_GOOD_TURN_RAD, _MOST_TURN_RAD = 0.09, 0.18
_FLOOR = "another floor: carpet, patterned tiles or mats, evenly lit; glossy and plain ones are not seen"


@dataclass(frozen=True, slots=True)
class _Flow:
    at_s: float
    quality: int


@dataclass(frozen=True, slots=True)
class _Range:
    at_s: float
    distance_m: float
    least_m: float
    most_m: float

    @property
    def measures(self) -> bool:
        return 0.0 < self.distance_m < self.most_m


class WalkRecord(Record):
    """A record that keeps each sample of the flow, of the range finder, and each pose, with its wall time."""

    def __init__(self, own_system_id: int) -> None:
        super().__init__(own_system_id, heartbeat="ground station")
        self.flows: list[_Flow] = []
        self.ranges: list[_Range] = []
        self.paths_m: list[tuple[float, float, float, float]] = []  # wall time; north, east, down
        self.headings_rad: list[tuple[float, float]] = []  # wall time; clockwise from north
        self.left_s = self.back_s = 0.0  # wall times: the mark was left, and it stands there again

    def take(self, message: Message, now_s: float) -> bool:
        """Take any message; see `Session.take`."""
        is_newest, kind = super().take(message, now_s), message.get_type()
        if not self.is_from_autopilot(message):
            return is_newest
        if kind in ("OPTICAL_FLOW_RAD", "OPTICAL_FLOW"):
            self.flows.append(_Flow(now_s, message.quality))
        elif kind == "DISTANCE_SENSOR" and message.orientation == mavlink.MAV_SENSOR_ROTATION_PITCH_270:
            metres = (message.current_distance, message.min_distance, message.max_distance)
            self.ranges.append(_Range(now_s, *(centimetres / 100 for centimetres in metres)))
        elif kind == "LOCAL_POSITION_NED":
            self.paths_m.append((now_s, message.x, message.y, message.z))
        elif kind == "ATTITUDE":
            self.headings_rad.append((now_s, message.yaw))
        return is_newest


def walk(client: VehicleClient, record: WalkRecord, seconds: float) -> None:
    """Say what to do with the drone, and receive meanwhile: stand, some seconds of carrying, stand."""
    for number, rate_hz in _RATES_HZ.items():
        record.send(request_rate(record.vehicle, number, rate_hz))
    client.run(STAND_S, "leave it on a mark on the floor, motors off")
    record.left_s = client.clock()
    client.run(seconds, "carry it as it will fly: about 1 m high, level, at a walk, and back to the mark")
    record.back_s = client.clock()
    client.run(STAND_S, "put it on the mark, facing as before, and leave it")
    record.listened_s = client.clock()


def examine_walk(record: WalkRecord) -> list[Check]:
    """What the walk has shown."""
    return [*_flow(record), *_range(record), *_drift(record)]


def _flow(record: WalkRecord) -> Checks:
    """How often the floor was seen while the drone was carried."""
    span_s = record.back_s - record.left_s
    carried = [each for each in record.flows if record.left_s <= each.at_s <= record.back_s]
    if len(carried) < _LEAST_FLOW_HZ * span_s:
        advice = "connect the sensor and set its driver's parameter, then restart the drone"
        yield missing("flow", f"{len(carried) / span_s:.0f} samples a second are received", advice)
        return
    least = max(1.0, record.parameters.get("EKF2_OF_QMIN", 1.0))
    bad = [each.quality < least for each in carried]
    share, period_s = sum(bad) / len(bad), span_s / len(bad)
    longest_s = period_s * max((len(list(run)) for is_bad, run in groupby(bad) if is_bad), default=0)
    quality = median(each.quality for each in carried)
    words = f"quality {quality:.0f} of 255, too low in {share:.0%} of {len(bad)} samples"
    words += f", for {longest_s:.1f} s at most" if share else ""
    if share > _WORST_SHARE:
        yield missing("flow", words, _FLOOR)
    elif share > _BAD_SHARE:
        yield note("flow", words, f"fly low and slowly, or over {_FLOOR}")
    else:
        yield good("flow", words)


def _range(record: WalkRecord) -> Checks:
    """Whether the range finder measured while the drone was carried, and how far it can."""
    carried = [each for each in record.ranges if record.left_s <= each.at_s <= record.back_s]
    if not carried:
        advice = "optical flow is a velocity only with the distance to the floor: connect a range finder"
        yield missing("range", "no DISTANCE_SENSOR that looks down is received", advice)
        return
    measured = [each.distance_m for each in carried if each.measures]
    share, most_m = 1.0 - len(measured) / len(carried), max(each.most_m for each in carried)
    span = f"{min(measured):.2f} to {max(measured):.2f} m" if measured else "nothing"
    words = f"{span} measured, to {most_m:.1f} m possible; none in {share:.0%} of {len(carried)} samples"
    if share > _BAD_RANGE_SHARE:
        yield missing("range", words, "less sun and gloss below, or a range finder with more power")
    elif most_m < _NEEDED_RANGE_M:
        advice = f"the challenge climbs to {_NEEDED_RANGE_M:g} m; a range finder to 4 m or more"
        yield note("range", words, advice)
    else:
        yield good("range", words)


def _drift(record: WalkRecord) -> Checks:
    """What the estimate says to have moved between two stays on the same mark."""
    began_m, ended_m = (_standing_at(record, until_s) for until_s in (record.left_s, record.listened_s))
    if began_m is None or ended_m is None:
        yield missing("walk", "no LOCAL_POSITION_NED is received", "the estimator does not use the flow yet")
        return
    carried = [place for at_s, *place in record.paths_m if record.left_s <= at_s <= record.back_s]
    carried = carried[::20] + carried[-1:]  # one a second: noise is no way
    walked_m = sum(dist(before, after) for before, after in pairwise(carried))
    if walked_m < _WALKED_M:
        advice = (
            "walk farther; or its estimator uses no flow in your hands, and only a flight shows the drift"
        )
        yield note("walk", f"by its estimate it was carried {walked_m:.1f} m", advice)
        return
    yield good("walk", f"carried {walked_m:.1f} m in {record.back_s - record.left_s:.0f} s, by its estimate")
    off_m = hypot(ended_m[0] - began_m[0], ended_m[1] - began_m[1])
    rate_m = off_m / sqrt(record.listened_s - record.left_s)
    words = f"{100 * off_m:.0f} cm beside the mark on returning"
    advice = "calibrate the sensors; check the flow sensor's rotation, its height and its distance"
    if rate_m > _MOST_DRIFT_M:
        yield missing("drift", words, advice)
    elif rate_m > _GOOD_DRIFT_M:
        yield note("drift", words, advice)
    else:
        yield good("drift", words)
    turned_rad = abs(remainder(ended_m[2] - began_m[2], 2 * pi))
    words = f"turned by {degrees(turned_rad):.1f}° on returning"
    if not isfinite(turned_rad) or turned_rad > _GOOD_TURN_RAD:
        advice = "was it put back facing as before? Else calibrate the compass, or fly where no steel is near"
        yield (missing if turned_rad > _MOST_TURN_RAD else note)("heading", words, advice)
    else:
        yield good("heading", words)


def _standing_at(record: WalkRecord, until_s: float) -> tuple[float, float, float] | None:
    """North, east (metres) and heading (radians) in the last seconds of a stay on the mark."""
    places = [
        (north, east) for at_s, north, east, _ in record.paths_m if until_s - _LAST_S <= at_s <= until_s
    ]
    headings = [heading for at_s, heading in record.headings_rad if until_s - _LAST_S <= at_s <= until_s]
    if not places or not headings:
        return None
    first = headings[0]
    heading_rad = first + fmean(remainder(each - first, 2 * pi) for each in headings)
    return fmean(north for north, _ in places), fmean(east for _, east in places), heading_rad
