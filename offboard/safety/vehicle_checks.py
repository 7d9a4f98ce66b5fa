"""Checks of what was measured of a vehicle, its link and its camera before arming."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, isnan
from statistics import median

from offboard.safety.check import Check, Outcome, passed

BATTERY_PERCENT = 40.0
MAX_LOST_SHARE = 0.05
MAX_ROUND_TRIP_S = 0.25
MIN_ANSWERS = 5
MAX_RATIO = 0.5  # of an innovation to what its gate lets pass; PX4 does not arm above it
MAX_CAMERA_AGE_S = 0.3
MIN_CAMERA_RATE_HZ = 8.0
MAX_CAMERA_GAP_S = 0.5


@dataclass(frozen=True, slots=True)
class BatteryFacts:
    """What a vehicle reports of its battery; NaN: nothing."""

    percent: float
    voltage_v: float


@dataclass(frozen=True, slots=True)
class EstimatorFacts:
    """ESTIMATOR_STATUS of a vehicle that stands.

    Attributes:
        reported: it was received; without it the other fields mean nothing.
        has_attitude: the estimator knows its attitude.
        has_position: likewise, horizontally, relative or absolute.
        has_height: likewise.
        largest_ratio: the largest of the innovations' test ratios.
    """

    reported: bool
    has_attitude: bool = False
    has_position: bool = False
    has_height: bool = False
    largest_ratio: float = 0.0


@dataclass(frozen=True, slots=True)
class LinkFacts:
    """What was measured of the link.

    Attributes:
        lost_share: of the vehicle's packets, 0 to 1.
        round_trips_s: of TIMESYNC requests that were answered.
        requests: how many were sent.
    """

    lost_share: float
    round_trips_s: tuple[float, ...]
    requests: int


@dataclass(frozen=True, slots=True)
class CameraFacts:
    """What was measured of the camera.

    Attributes:
        rate_hz: of the images.
        longest_gap_s: between two images.
        age_s: of an image on arrival; NaN if it has no time stamp.
        assumed_age_s: what the user says of an image without a time stamp.
        size_px: width and height.
        problem: why there is no image; empty if there are some.
    """

    rate_hz: float = 0.0
    longest_gap_s: float = 0.0
    age_s: float = float("nan")
    assumed_age_s: float = 0.0
    size_px: tuple[int, int] = (0, 0)
    problem: str = ""


def battery_check(facts: BatteryFacts) -> Check:
    """Whether the battery is charged for a try and the way back."""
    if isnan(facts.percent):
        advice = "measure it, then accept it by --accept battery"
        return Check("battery", Outcome.FAIL, "its charge is not reported", f"{BATTERY_PERCENT:g} %", advice)
    volts = "" if isnan(facts.voltage_v) else f", {facts.voltage_v:.1f} V"
    good = facts.percent >= BATTERY_PERCENT
    value = f"{facts.percent:.0f} %{volts}"
    return passed("battery", good, value, f"{BATTERY_PERCENT:g} % or more", "charge it")


def estimator_check(facts: EstimatorFacts) -> Check:
    """Whether the estimator knows where the drone is, and its measurements agree."""
    name, limit = "estimator", f"ratios up to {MAX_RATIO:g}"
    if not facts.reported:
        return Check(name, Outcome.FAIL, "no ESTIMATOR_STATUS is received", limit, "let the link carry it")
    known = {
        "attitude": facts.has_attitude,
        "position": facts.has_position,
        "height": facts.has_height,
    }
    unknown = [what for what, is_known in known.items() if not is_known]
    if unknown:
        advice = "wait for its estimate; see docs/real-drone.md, step 6"
        return Check(name, Outcome.FAIL, f"it does not know its {' and '.join(unknown)}", limit, advice)
    good = isfinite(facts.largest_ratio) and facts.largest_ratio <= MAX_RATIO
    advice = "keep the drone still, or correct the sensor that disagrees"
    return passed(name, good, f"largest ratio of an innovation {facts.largest_ratio:.2f}", limit, advice)


def link_checks(facts: LinkFacts) -> list[Check]:
    """Whether the link loses little and answers soon."""
    loss = passed(
        "link loss",
        facts.lost_share <= MAX_LOST_SHARE,
        f"{facts.lost_share:.1%} of packets lost",
        f"{MAX_LOST_SHARE:.0%}",
        "move nearer, or use a better link",
    )
    limit, advice = f"{1000 * MAX_ROUND_TRIP_S:g} ms", "use a faster link"
    if len(facts.round_trips_s) < MIN_ANSWERS:
        value = f"{len(facts.round_trips_s)} of {facts.requests} time requests answered"
        late = Check("link latency", Outcome.FAIL, value, limit, "check that the link takes requests")
        return [loss, late]
    middle_s, worst_s = median(facts.round_trips_s), max(facts.round_trips_s)
    value = f"round trip {1000 * middle_s:.0f} ms, at worst {1000 * worst_s:.0f} ms"
    return [loss, passed("link latency", worst_s <= MAX_ROUND_TRIP_S, value, limit, advice)]


def camera_checks(facts: CameraFacts) -> list[Check]:
    """Whether images come often, regularly and soon."""
    if facts.problem:
        return [Check("camera", Outcome.FAIL, facts.problem, "", "check its URL and its cable")]
    width, height = facts.size_px
    good = facts.rate_hz >= MIN_CAMERA_RATE_HZ and facts.longest_gap_s <= MAX_CAMERA_GAP_S
    value = (
        f"{facts.rate_hz:.1f} images a second of {width} × {height}, longest gap {facts.longest_gap_s:.2f} s"
    )
    limit = f"{MIN_CAMERA_RATE_HZ:g} a second, gaps up to {MAX_CAMERA_GAP_S:g} s"
    rate = passed("camera", good, value, limit, "use a better link, or fewer pixels")
    limit = f"{MAX_CAMERA_AGE_S:g} s"
    if isnan(facts.age_s):
        good = 0.0 <= facts.assumed_age_s <= MAX_CAMERA_AGE_S
        value = f"{facts.assumed_age_s:g} s by --camera-delay; its images have no time stamps"
        return [rate, passed("camera delay", good, value, limit, "use a camera with less delay")]
    good = facts.age_s <= MAX_CAMERA_AGE_S
    return [rate, passed("camera delay", good, f"{facts.age_s:.2f} s", limit, "use a camera with less delay")]
