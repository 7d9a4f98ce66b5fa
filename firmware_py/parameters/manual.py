"""Sticks, orbit and follow-me: modes in which somebody outside leads."""

from __future__ import annotations

from firmware_py.parameters.declare import Group

INPUT = Group("Commander")

INPUT.choice(
    "COM_RC_IN_MODE",
    1,
    {
        0: "RC only",
        1: "MAVLink only",
        2: "RC or MAVLink, whichever comes",
        3: "RC or MAVLink, the first one stays",
        4: "No sticks at all",
        5: "RC before MAVLink 1 before MAVLink 2",
        6: "MAVLink 1 before MAVLink 2 before RC",
        7: "RC before MAVLink 2 before MAVLink 1",
        8: "MAVLink 2 before MAVLink 1 before RC",
    },
    "Where sticks may come from",
    "MAVLink means MANUAL_CONTROL: joysticks of ground stations and apps.",
)
INPUT.real(
    "COM_RC_LOSS_T",
    0.5,
    (0.0, 35.0),
    "s",
    "Sticks that were not heard for this long are lost",
    increment=0.1,
)
INPUT.mask(
    "COM_RC_OVERRIDE",
    1,
    {0: "In modes that fly by themselves", 1: "In offboard mode"},
    "Moving the sticks takes over",
    "The pilot then flies in position mode.",
)
INPUT.real(
    "COM_RC_STICK_OV",
    30.0,
    (5.0, 80.0),
    "%",
    "Moving the sticks means further than this",
    decimals=0,
    increment=0.05,
)

STICKS = Group("Multicopter Position Control")

STICKS.real(
    "MPC_VEL_MANUAL", 10.0, (0.1, 20.0), "m/s", "Horizontal speed at full stick in position mode", increment=1
)
STICKS.real(
    "MPC_VEL_MAN_BACK",
    -1.0,
    (-1.0, 20.0),
    "m/s",
    "Speed backwards at full stick in position mode",
    details="Below zero: as forwards.",
    increment=1,
)
STICKS.real(
    "MPC_VEL_MAN_SIDE",
    -1.0,
    (-1.0, 20.0),
    "m/s",
    "Speed sideways at full stick in position mode",
    details="Below zero: as forwards.",
    increment=1,
)
STICKS.real(
    "MPC_MAN_TILT_MAX",
    35.0,
    (1.0, 70.0),
    "deg",
    "Tilt at full stick in stabilized and altitude mode",
    decimals=0,
    increment=1,
)
STICKS.real(
    "MPC_MAN_Y_MAX",
    150.0,
    (0.0, 400.0),
    "deg/s",
    "Yaw rate at full stick, acro mode apart",
    decimals=0,
    increment=10,
)
STICKS.real(
    "MPC_MANTHR_MIN",
    0.08,
    (0.0, 1.0),
    "norm",
    "Thrust at the throttle's lowest place in stabilized mode",
    decimals=2,
    increment=0.01,
)
STICKS.real(
    "MPC_HOLD_MAX_XY",
    0.8,
    (0.0, 3.0),
    "m/s",
    "With centred sticks it stops drifting below this horizontal speed",
    details="0: always.",
    decimals=2,
)
STICKS.real(
    "MPC_HOLD_MAX_Z",
    0.6,
    (0.0, 3.0),
    "m/s",
    "With a centred throttle it keeps its height below this vertical speed",
    details="0: always.",
    decimals=2,
)
STICKS.real(
    "MPC_JERK_MAX",
    8.0,
    (0.5, 500.0),
    "m/s^3",
    "How quickly the sticks change acceleration",
    decimals=0,
    increment=1,
)
STICK_DEADZONE = Group("Manual Control")

STICK_DEADZONE.real(
    "MAN_DEADZONE",
    0.1,
    (0.0, 1.0),
    "norm",
    "Sticks this near to their middle count as centred",
    decimals=2,
    increment=0.01,
)

ORBIT = Group("Flight Task Orbit")

ORBIT.real("MC_ORBIT_RAD_MAX", 1000.0, (1.0, 10_000.0), "m", "Radius of the greatest orbit", increment=0.5)
ORBIT.choice(
    "MC_ORBIT_YAW_MOD",
    0,
    {
        0: "Towards the centre",
        1: "As at the start",
        2: "Uncontrolled",
        3: "Along the circle",
        4: "By the yaw stick",
    },
    "Where an orbit looks that does not say so",
)

FOLLOW = Group("Follow target")

FOLLOW.real("FLW_TGT_DST", 8.0, (1.0, 10_000.0), "m", "Horizontal distance to who is followed")
FOLLOW.real("FLW_TGT_HT", 8.0, (1.0, 10_000.0), "m", "Height above who is followed, or above home")
FOLLOW.real(
    "FLW_TGT_FA",
    180.0,
    (-180.0, 180.0),
    "deg",
    "Side from which it follows",
    details="Counted clockwise from the way who is followed goes: 0 ahead, 90 to the right, 180 behind.",
)
FOLLOW.real(
    "FLW_TGT_RS",
    0.1,
    (0.0, 1.0),
    "norm",
    "How slowly it takes up movements of who is followed",
    details="0: at once; nearer to 1: smoother and later.",
    decimals=2,
)
FOLLOW.real("FLW_TGT_MAX_VEL", 5.0, (0.0, 20.0), "m/s", "Speed around who is followed")
FOLLOW.choice(
    "FLW_TGT_ALT_M",
    0,
    {
        0: "At a height above home",
        1: "As 0: there is no terrain here",
        2: "At a height above who is followed",
    },
    "Which height FLW_TGT_HT means",
)
