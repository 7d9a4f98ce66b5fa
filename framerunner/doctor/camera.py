"""What the doctor says about a camera and its calibration, when it is given them."""

from __future__ import annotations

from dataclasses import replace

from framerunner.doctor.findings import Finding, Level
from framerunner.flying.plan import CAMERA_DELAY_S
from framerunner.preflight.camera import CameraTimes, calibration_facts
from offboard.safety.check import Check, Outcome
from offboard.safety.vehicle_checks import calibration_checks, camera_checks
from vision.calibration.model import Calibration

LOOK_S = 3.0
"""For how long images are received."""
_LEVELS = {Outcome.PASS: Level.GOOD, Outcome.NOTE: Level.NOTE, Outcome.FAIL: Level.MISSING}


def examine_camera(
    times: CameraTimes | None, calibration: Calibration | None, clock_ms: tuple[int, float] | None
) -> list[Finding]:
    """What was measured of the camera, and whether its lens, mounting and delay are known.

    Args:
        times: of its images; None: no camera was given.
        calibration: None: none was given.
        clock_ms: vehicle time in milliseconds at a monotonic wall time, seconds; None: not known.
    """
    measured_s = None if calibration is None else calibration.delay_s
    assumed_s = CAMERA_DELAY_S if measured_s is None else measured_s
    checks: list[Check] = []
    if times is not None:
        checks += camera_checks(times.facts(clock_ms, assumed_s))
        if not times.problem and not any(stamp is not None for stamp in times.stamps_us):
            checks[-1] = _delay_check(checks[-1], measured_s)
    checks += calibration_checks(calibration_facts(calibration, (0, 0) if times is None else times.size_px))
    return [Finding(_LEVELS[each.outcome], each.name, each.value, each.advice) for each in checks]


def _delay_check(check: Check, measured_s: float | None) -> Check:
    """The check of the delay of images without time stamps, with where it is from."""
    if measured_s is None:
        value = f"never measured; {CAMERA_DELAY_S:g} s are assumed, as its images have no time stamps"
        advice = "run framerunner camera latency, and give fly --camera-delay"
        return replace(check, outcome=Outcome.NOTE, value=value, advice=advice)
    value = f"{measured_s:.3f} s by the calibration; its images have no time stamps"
    return replace(check, value=value)
