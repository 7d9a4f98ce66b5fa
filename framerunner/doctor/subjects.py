"""What the doctor's findings may be about.

Checks before arming are accepted by these names, so all are known before a vehicle is heard.
"""

from __future__ import annotations

from typing import Literal, Protocol

from offboard.safety import check
from offboard.safety.check import Check

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


class _Judge(Protocol):
    """Makes a check of a known name."""

    def __call__(self, name: Subject, value: str, advice: str = "") -> Check:
        """See `offboard.safety.check.good` and the others."""


good: _Judge = check.good
note: _Judge = check.note
missing: _Judge = check.missing
