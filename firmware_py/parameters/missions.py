"""Missions, take-off height, return, geofence."""

from __future__ import annotations

from firmware_py.parameters.declare import Group

MISSIONS = Group("Mission")

MISSIONS.real(
    "MIS_TAKEOFF_ALT",
    2.5,
    (0.0, 10_000.0),
    "m",
    "Height of a take-off that names none",
    increment=0.5,
)
MISSIONS.real(
    "MIS_YAW_ERR",
    12.0,
    (0.0, 90.0),
    "deg",
    "A waypoint's heading is reached when it is this near",
    increment=1,
)
MISSIONS.real(
    "MIS_YAW_TMT",
    -1.0,
    (-1.0, 20.0),
    "s",
    "A waypoint waits this long for its heading",
    details="-1: until it is reached.",
    increment=1,
)
MISSIONS.real(
    "MIS_DIST_1WP",
    10_000.0,
    (-1.0, 100_000.0),
    "m",
    "The first waypoint may be this far from home",
    details="A warning says when it is further. Zero or less: no such check.",
    increment=100,
)
MISSIONS.real(
    "NAV_ACC_RAD",
    2.0,
    (0.05, 200.0),
    "m",
    "A waypoint counts as reached within this horizontal distance",
    details="Items may name their own.",
    decimals=2,
    increment=0.5,
)
MISSIONS.real(
    "NAV_MC_ALT_RAD",
    0.8,
    (0.05, 200.0),
    "m",
    "A waypoint counts as reached within this difference of height",
    decimals=2,
    increment=0.5,
)
MISSIONS.real(
    "NAV_LOITER_RAD",
    80.0,
    (-10_000.0, 10_000.0),
    "m",
    "Radius of a loiter circle that names none",
    details="Positive: clockwise. A multicopter holds on the spot instead.",
    increment=0.5,
)

RETURN = Group("Return Mode")

RETURN.real(
    "RTL_RETURN_ALT",
    30.0,
    (0.0, 10_000.0),
    "m",
    "It climbs to this height above home before it flies there",
    details="Near home it climbs less: see RTL_CONE_ANG. Higher up it stays where it is.",
    increment=0.5,
)
RETURN.real(
    "RTL_DESCEND_ALT",
    10.0,
    (0.0, 10_000.0),
    "m",
    "Above home it sinks to this height before it lands",
    increment=0.5,
)
RETURN.real(
    "RTL_LAND_DELAY",
    0.0,
    (-1.0, 86_400.0),
    "s",
    "It waits this long at RTL_DESCEND_ALT before it lands",
    details="-1: it stays there.",
    increment=0.5,
)
RETURN.real(
    "RTL_MIN_DIST",
    10.0,
    (0.5, 10_000.0),
    "m",
    "Nearer to home than this it climbs only as RTL_CONE_ANG says",
    increment=0.5,
)
RETURN.choice(
    "RTL_CONE_ANG",
    45,
    {
        0: "No cone: always climb to RTL_RETURN_ALT",
        25: "25 degrees",
        45: "45 degrees",
        65: "65 degrees",
        80: "80 degrees",
        90: "Climb to RTL_DESCEND_ALT only",
    },
    "Half angle of a cone upon home within which it climbs less",
    "The nearer to home a return begins, the lower it flies.",
    unit="deg",
)
RETURN.choice(
    "RTL_TYPE",
    0,
    {
        0: "Nearest of home and rally points, straight",
        1: "Nearest rally point, or home if there is none, straight",
        2: "Along the mission to its landing, or back along it to home",
        3: "Nearest of home, rally points and the mission's landing, straight",
        4: "As 2, whichever way has fewer waypoints",
    },
    "Where a return goes, and which way",
)

GEOFENCE = Group("Geofence")

GEOFENCE.choice(
    "GF_ACTION",
    2,
    {0: "None", 1: "Warning", 2: "Hold mode", 3: "Return mode", 4: "Terminate", 5: "Land mode"},
    "What it does when it leaves the fence",
    "Terminate stops the motors: it falls.",
)
GEOFENCE.real(
    "GF_MAX_HOR_DIST",
    0.0,
    (0.0, 10_000.0),
    "m",
    "A fence at this horizontal distance from home",
    details="0: none.",
    increment=1,
)
GEOFENCE.real(
    "GF_MAX_VER_DIST",
    0.0,
    (0.0, 10_000.0),
    "m",
    "A fence at this height above home",
    details="0: none.",
    increment=1,
)
GEOFENCE.switch(
    "GF_PREDICT",
    0,
    "Act before the fence is crossed",
    "Acts as soon as the way needed to brake reaches beyond the fence.",
)
GEOFENCE.fact("GF_SOURCE", 0, "The fence looks at the estimated position")
