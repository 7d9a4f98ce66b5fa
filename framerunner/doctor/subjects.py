"""What the doctor's findings may be about.

Checks before arming are accepted by these names, so all are known before a vehicle is heard.
"""

from __future__ import annotations

from typing import Literal

from framerunner.doctor.findings import Finding, Level

Subject = Literal[
    # Of both autopilots.
    "armed",
    "attitude",
    "autopilot",
    "battery",
    "estimate",
    "estimator",
    "failsafe",
    "ground station lost",
    "health",
    "height",
    "landed",
    "link",
    "local position",
    "one vehicle",
    "parameters",
    "position",
    "pre-arm checks",
    "sensors",
    "setpoints lost",
    "state",
    # Of PX4.
    "battery low",
    "COM_DISARM_PRFLT",
    "COM_OF_LOSS_T",
    "fence",
    "GF_MAX_HOR_DIST",
    "GF_MAX_VER_DIST",
    "innovations",
    "MC_YAWRATE_MAX",
    "MPC_XY_VEL_MAX",
    "MPC_Z_VEL_MAX_DN",
    "MPC_Z_VEL_MAX_UP",
    "offboard",
    # Of ArduPilot.
    "DISARM_DELAY",
    "FENCE_ALT_MAX",
    "FENCE_RADIUS",
    "GUID_OPTIONS",
    "guided",
    "radio control lost",
    "WPNAV_SPEED",
    "WPNAV_SPEED_DN",
    "WPNAV_SPEED_UP",
]

CAMERA_SUBJECTS = ("camera", "camera delay", "camera calibration", "camera mounting")


def finding(level: Level, subject: Subject, text: str, advice: str = "") -> Finding:
    """A finding of the doctor; see `Finding`."""
    return Finding(level, subject, text, advice)


def good(subject: Subject, text: str, advice: str = "") -> Finding:
    """Nothing is wrong."""
    return Finding(Level.GOOD, subject, text, advice)


def note(subject: Subject, text: str, advice: str = "") -> Finding:
    """Worth knowing."""
    return Finding(Level.NOTE, subject, text, advice)


def missing(subject: Subject, text: str, advice: str = "") -> Finding:
    """Something that the challenge needs is missing."""
    return Finding(Level.MISSING, subject, text, advice)
