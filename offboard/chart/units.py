"""The units of what a mission reads and sets, for displays."""

from __future__ import annotations

_OF_NAMES = {
    "imu.x": "m",
    "imu.y": "m",
    "imu.z": "m",
    "imu.yaw": "rad",
    "cmd.vel_x": "m/s",
    "cmd.vel_y": "m/s",
    "cmd.vel_z": "m/s",
    "cmd.rot_z": "rad/s",
}
_OF_DETECTIONS = {"n": "px", "s": "px", "e": "px", "w": "px", "d": "m", "a": "deg", "signed_a": "deg"}
_DETECTIONS = ("frame", "cam.red", "cam.green", "cam.blue")
_OF_SUFFIXES = (
    ("_rad_s", "rad/s"),
    ("_m_s", "m/s"),
    ("_us", "us"),
    ("_deg", "deg"),
    ("_rad", "rad"),
    ("_px", "px"),
    ("_m", "m"),
    ("_s", "s"),
)


def unit_of(name: str) -> str:
    """The unit of a dotted name of the pilot, such as "m" of "frame.d"; "" if it has none or none is known.

    Names that end with their unit, as a contestant's should, have that one.
    """
    owner, _, last = name.rpartition(".")
    if owner in _DETECTIONS:
        return _OF_DETECTIONS.get(last, "")
    if name in _OF_NAMES:
        return _OF_NAMES[name]
    if last.startswith("seconds_"):
        return "s"
    return next((unit for suffix, unit in _OF_SUFFIXES if last.endswith(suffix)), "")
