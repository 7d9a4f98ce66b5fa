"""Turning: rates of the body, and how a landing is noticed."""

from __future__ import annotations

from firmware_py.parameters.declare import Group

ATTITUDE = Group("Multicopter Attitude Control")

_RATE = (0.0, 1800.0)

for _name, _most, _axis in (("ROLL", 220.0, "Roll"), ("PITCH", 220.0, "Pitch"), ("YAW", 200.0, "Yaw")):
    ATTITUDE.real(
        f"MC_{_name}RATE_MAX",
        _most,
        _RATE,
        "deg/s",
        f"{_axis} rate never exceeded, acro mode apart",
        increment=5,
    )
ATTITUDE.real(
    "MC_YAW_P",
    2.8,
    (0.0, 5.0),
    "1/s",
    "Yaw rate per radian of heading error",
    decimals=2,
    increment=0.1,
)

ACRO = Group("Multicopter Acro Mode")

for _name, _axis in (("R", "Roll"), ("P", "Pitch"), ("Y", "Yaw")):
    ACRO.real(
        f"MC_ACRO_{_name}_MAX", 100.0, _RATE, "deg/s", f"{_axis} rate at full stick in acro mode", increment=5
    )

LANDING = Group("Land Detector")

LANDING.real(
    "LNDMC_TRIG_TIME",
    1.0,
    (0.1, 10.0),
    "s",
    "It stands still this long until it has landed",
)
LANDING.real(
    "LNDMC_Z_VEL_MAX",
    0.25,
    (0.0, 5.0),
    "m/s",
    "Standing still means less vertical speed than this",
    decimals=2,
)
LANDING.real(
    "LNDMC_XY_VEL_MAX", 1.5, (0.0, 10.0), "m/s", "Standing still means less horizontal speed than this"
)
LANDING.real(
    "LNDMC_ROT_MAX", 20.0, (0.0, 360.0), "deg/s", "Standing still means turning more slowly than this"
)
