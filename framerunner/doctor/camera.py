"""What the doctor says about a camera and its calibration, when it is given them."""

from __future__ import annotations

from framerunner.camera_calibration.camera_delay import delay_of
from framerunner.doctor.camera_times import CameraTimes, calibration_facts
from offboard.safety.check import Check
from offboard.safety.vehicle_checks import calibration_checks, camera_checks
from vision.calibration.model import Calibration

LOOK_S = 3.0
"""For how long images are received."""


def examine_camera(
    times: CameraTimes | None, calibration: Calibration | None, clock_ms: tuple[int, float] | None
) -> list[Check]:
    """What was measured of the camera, and whether its lens, mounting and delay are known.

    Args:
        times: of its images; None: no camera was given.
        calibration: None: none was given.
        clock_ms: vehicle time in milliseconds at a monotonic wall time, seconds; None: not known.
    """
    checks: list[Check] = []
    if times is not None:
        checks += camera_checks(times.facts(clock_ms, delay_of(None, calibration)))
    checks += calibration_checks(calibration_facts(calibration, (0, 0) if times is None else times.size_px))
    return checks
