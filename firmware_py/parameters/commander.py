"""Arming and disarming, pre-flight checks, and when it takes off or has flown long enough."""

from __future__ import annotations

from firmware_py.parameters.declare import Group

COMMANDER = Group("Commander")

COMMANDER.real(
    "COM_DISARM_LAND",
    2.0,
    (-1.0, 20.0),
    "s",
    "Disarm this long after landing",
    details="Zero or less: it stays armed until it is told to disarm.",
    increment=0.1,
)
COMMANDER.real(
    "COM_DISARM_PRFLT",
    10.0,
    (-1.0, 60.0),
    "s",
    "Disarm when it has not taken off this long after arming",
    details="Zero or less: never.",
    increment=0.1,
)
COMMANDER.real(
    "COM_SPOOLUP_TIME",
    1.0,
    (0.0, 30.0),
    "s",
    "Motors idle at least this long after arming before it may take off",
    increment=0.1,
)
COMMANDER.real(
    "COM_ARM_BAT_MIN",
    -1.0,
    (-1.0, 0.9),
    "norm",
    "Do not arm with less charge in the battery than this",
    details="A share of the full charge. Below zero: BAT_CRIT_THR is taken.",
    decimals=2,
    increment=0.01,
)
COMMANDER.choice(
    "COM_TAKEOFF_ACT",
    0,
    {0: "Hold", 1: "Mission (if valid)"},
    "What follows a completed take-off",
)
COMMANDER.whole(
    "COM_FLT_TIME_MAX",
    -1,
    (-1, 86_400),
    "s",
    "Return when it has been in the air this long",
    details="It then refuses all modes but return and land. -1: no limit.",
)
