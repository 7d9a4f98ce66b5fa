"""Checks of what was measured of a vehicle, its link and its camera before arming."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import degrees, isfinite, isnan
from statistics import median

from framerunner.wire.session.estimator import EstimatorStatus
from offboard.safety.check import Check, Outcome, passed
from vision.calibration.model import Calibration, Mounting

BATTERY_PERCENT = 40.0
MAX_LOST_SHARE = 0.05
MAX_ROUND_TRIP_S = 0.25
MIN_ANSWERS = 5
MAX_RATIO = 0.5  # of an innovation to what its gate lets pass; PX4 does not arm above it
MAX_CAMERA_AGE_S = 0.3
CLOCK_TOLERANCE_S = 0.05  # of the vehicle's clock as the link shows it
MIN_CAMERA_RATE_HZ = 8.0
MAX_CAMERA_GAP_S = 0.5
OLD_CALIBRATION_DAYS = 90


@dataclass(frozen=True, slots=True)
class CameraFacts:
    """What was measured of the camera.

    Attributes:
        rate_hz: of the images.
        longest_gap_s: between two images.
        age_s: of an image on arrival; NaN: not known.
        has_stamps: images have the vehicle time at which they were taken.
        assumed_age_s: of an image without a time stamp.
        assumed_by: what says so; empty: it was never measured.
        size_px: width and height.
        problem: why there is no image; empty if there are some.
    """

    rate_hz: float = 0.0
    longest_gap_s: float = 0.0
    age_s: float = float("nan")
    has_stamps: bool = False
    assumed_age_s: float = 0.0
    assumed_by: str = ""
    size_px: tuple[int, int] = (0, 0)
    problem: str = ""


def battery_check(percent: float, voltage_v: float) -> Check:
    """Whether the battery is charged for a try and the way back; NaN: the vehicle reports nothing."""
    if isnan(percent):
        advice = "measure it, then accept it by --accept battery"
        return Check("battery", Outcome.FAIL, "its charge is not reported", f"{BATTERY_PERCENT:g} %", advice)
    volts = "" if isnan(voltage_v) else f", {voltage_v:.1f} V"
    good = percent >= BATTERY_PERCENT
    value = f"{percent:.0f} %{volts}"
    return passed("battery", good, value, f"{BATTERY_PERCENT:g} % or more", "charge it")


def estimator_check(status: EstimatorStatus | None, message: str) -> Check:
    """Whether the estimator knows where the drone is, and its measurements agree.

    Args:
        status: what it reports while the drone stands; None: nothing.
        message: that reports it.
    """
    name, limit = "estimator", f"ratios up to {MAX_RATIO:g}"
    if status is None:
        return Check(name, Outcome.FAIL, f"no {message} is received", limit, "let the link carry it")
    known = {
        "attitude": status.has_attitude,
        "position": status.has_position,
        "height": status.has_height,
    }
    unknown = [what for what, is_known in known.items() if not is_known]
    if unknown:
        advice = "wait for its estimate; see docs/real-drone.md, step 6"
        return Check(name, Outcome.FAIL, f"it does not know its {' and '.join(unknown)}", limit, advice)
    good = isfinite(status.largest_ratio) and status.largest_ratio <= MAX_RATIO
    advice = "keep the drone still, or correct the sensor that disagrees"
    return passed(name, good, f"largest ratio of an innovation {status.largest_ratio:.2f}", limit, advice)


def link_checks(lost_share: float, round_trips_s: Sequence[float], requests: int) -> list[Check]:
    """Whether the link loses little and answers soon.

    Args:
        lost_share: of the vehicle's packets, 0 to 1.
        round_trips_s: of requests for its time that were answered.
        requests: how many were sent.
    """
    loss = passed(
        "link loss",
        lost_share <= MAX_LOST_SHARE,
        f"{lost_share:.1%} of packets lost",
        f"{MAX_LOST_SHARE:.0%}",
        "move nearer, or use a better link",
    )
    limit, advice = f"{1000 * MAX_ROUND_TRIP_S:g} ms", "use a faster link"
    if len(round_trips_s) < MIN_ANSWERS:
        value = f"{len(round_trips_s)} of {requests} time requests answered"
        late = Check("link latency", Outcome.FAIL, value, limit, "check that the link takes requests")
        return [loss, late]
    middle_s, worst_s = median(round_trips_s), max(round_trips_s)
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
    return [rate, _camera_delay_check(facts)]


def _camera_delay_check(facts: CameraFacts) -> Check:
    name, limit, advice = "camera delay", f"{MAX_CAMERA_AGE_S:g} s", "use a camera with less delay"
    if isfinite(facts.age_s):
        if facts.age_s < -CLOCK_TOLERANCE_S:
            value = f"{facts.age_s:.2f} s: from the future"
            told = "its clock is not the vehicle's; check what stamps the images"
            return Check(name, Outcome.FAIL, value, limit, told)
        return passed(name, facts.age_s <= MAX_CAMERA_AGE_S, f"{facts.age_s:.2f} s", limit, advice)
    if facts.has_stamps:
        value = "not known: its images have vehicle times, and no clock of the vehicle is received"
        return Check(name, Outcome.NOTE, value, limit, "let the link carry ATTITUDE")
    if not facts.assumed_by:
        value = f"never measured; {facts.assumed_age_s:g} s are assumed, as its images have no time stamps"
        told = "run framerunner camera latency, and give --camera-delay"
        return Check(name, Outcome.NOTE, value, limit, told)
    good = 0.0 <= facts.assumed_age_s <= MAX_CAMERA_AGE_S
    value = f"{facts.assumed_age_s:.3f} s by {facts.assumed_by}; its images have no time stamps"
    return passed(name, good, value, limit, advice)


def calibration_checks(
    calibration: Calibration | None, size_px: tuple[int, int], days_since: Callable[[str | None], int | None]
) -> list[Check]:
    """Whether the camera's lens and its mounting on the drone were measured, for missions that map gates.

    Args:
        calibration: of the camera; None: there is none.
        size_px: width and height of the camera's images; zeros: there was none.
        days_since: a day that the calibration names; None: not known.
    """
    name = "camera calibration"
    if calibration is None:
        advice = "run framerunner camera calibrate, then camera extrinsics, and give --calibration"
        return [Check(name, Outcome.NOTE, "none: the scenario's camera is assumed", "", advice)]
    calibrated_px, mounting = (calibration.width_px, calibration.height_px), calibration.mounting
    mounted = _mounting_check(mounting, None if mounting is None else days_since(mounting.measured_on))
    limit = f"images of {calibrated_px[0]} × {calibrated_px[1]}"
    if any(size_px) and size_px != calibrated_px:
        value = f"images have {size_px[0]} × {size_px[1]}"
        advice = "calibrate it with images as it gives them in flight"
        return [Check(name, Outcome.FAIL, value, limit, advice), mounted]
    advice = "make it again if lens, focus or resolution were changed since"
    made_days = days_since(calibration.made_on)
    return [_aged(Check(name, Outcome.PASS, "made", limit), made_days, advice), mounted]


def _mounting_check(mounting: Mounting | None, days: int | None) -> Check:
    name = "camera mounting"
    if mounting is None:
        value = "never measured; the camera is taken to look straight ahead"
        return Check(name, Outcome.NOTE, value, "", "run framerunner camera extrinsics")
    roll, pitch, yaw = (degrees(angle) for angle in mounting.angles_frd_rad)
    value = f"roll {roll:.1f}, pitch {pitch:.1f}, yaw {yaw:.1f} degrees"
    if mounting.angles_std_rad is not None:
        value += f" (1 sigma {', '.join(f'{degrees(each):.2f}' for each in mounting.angles_std_rad)})"
    advice = "measure it again if the camera or the drone's markers were moved since"
    return _aged(Check(name, Outcome.PASS, f"{value}, measured"), days, advice)


def _aged(check: Check, days: int | None, advice: str) -> Check:
    """The check with its age in words; one that is old, or of unknown age, is noted."""
    age = "on an unknown day" if days is None else "today" if days <= 0 else f"{days} days ago"
    outcome = Outcome.PASS if days is not None and days <= OLD_CALIBRATION_DAYS else Outcome.NOTE
    told = advice if outcome is Outcome.NOTE else ""
    return replace(check, outcome=outcome, value=f"{check.value} {age}", advice=told)
