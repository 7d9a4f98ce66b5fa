"""How fast, how hard and how steeply it flies.

The airframe's own limits hold as well. Least values are often smaller than PX4's: there they are advice and a
smaller value is taken all the same, here they are kept to, and small arenas are flown slowly.
"""

from __future__ import annotations

from firmware_py.parameters.declare import Group

POSITION = Group("Multicopter Position Control")

_SPEED = (0.1, 20.0)
_CLIMB = (0.1, 8.0)
_SINK = (0.1, 4.0)

POSITION.real(
    "MPC_XY_VEL_MAX",
    12.0,
    _SPEED,
    "m/s",
    "Horizontal speed never exceeded",
    details="Limits every mode that controls velocity, setpoints from outside included.",
    increment=1,
)
POSITION.real(
    "MPC_XY_CRUISE",
    5.0,
    _SPEED,
    "m/s",
    "Horizontal speed in modes that fly by themselves",
    details="For missions, return and repositioning, where no other speed is commanded.",
    decimals=0,
    increment=1,
)
POSITION.real("MPC_Z_VEL_MAX_UP", 3.0, _CLIMB, "m/s", "Climb never exceeded", increment=0.1)
POSITION.real("MPC_Z_VEL_MAX_DN", 1.5, _SINK, "m/s", "Descent never exceeded", increment=0.1)
POSITION.real("MPC_Z_V_AUTO_UP", 3.0, _CLIMB, "m/s", "Climb in modes that fly by themselves", increment=0.5)
POSITION.real("MPC_Z_V_AUTO_DN", 1.5, _SINK, "m/s", "Descent in modes that fly by themselves", increment=0.5)
POSITION.real(
    "MPC_XY_P",
    0.95,
    (0.0, 2.0),
    "1/s",
    "Horizontal speed per metre of horizontal distance to the place wanted",
    decimals=2,
    increment=0.1,
)
POSITION.real(
    "MPC_Z_P",
    1.0,
    (0.1, 1.5),
    "1/s",
    "Vertical speed per metre of height to the height wanted",
    decimals=2,
    increment=0.1,
)
POSITION.real(
    "MPC_ACC_HOR",
    3.0,
    (0.5, 15.0),
    "m/s^2",
    "Horizontal acceleration in modes that fly by themselves, and of the sticks",
    increment=1,
)
POSITION.real(
    "MPC_ACC_HOR_MAX",
    5.0,
    (0.5, 15.0),
    "m/s^2",
    "Horizontal acceleration never exceeded",
    decimals=2,
    increment=1,
)
POSITION.real("MPC_ACC_UP_MAX", 4.0, (0.5, 15.0), "m/s^2", "Upward acceleration", increment=1)
POSITION.real("MPC_ACC_DOWN_MAX", 3.0, (0.5, 15.0), "m/s^2", "Downward acceleration", increment=1)
POSITION.real(
    "MPC_JERK_AUTO",
    4.0,
    (0.5, 80.0),
    "m/s^3",
    "How quickly acceleration changes in modes that fly by themselves",
    increment=1,
)
POSITION.real(
    "MPC_TILTMAX_AIR",
    45.0,
    (5.0, 89.0),
    "deg",
    "Tilt never exceeded where velocity is controlled",
    decimals=0,
    increment=1,
)
POSITION.real(
    "MPC_THR_HOVER",
    0.5,
    (0.01, 0.8),
    "norm",
    "Thrust that hovers, as a share of full thrust",
    details="The middle of the throttle stick means this in modes without height control.",
    decimals=2,
    increment=0.01,
)
POSITION.real(
    "MPC_THR_MIN",
    0.12,
    (0.0, 0.5),
    "norm",
    "Least thrust where height is controlled",
    details="A fifth of the weight is enough in any case.",
    decimals=2,
    increment=0.01,
)
POSITION.real(
    "MPC_THR_MAX",
    1.0,
    (0.1, 1.0),
    "norm",
    "Most thrust where height is controlled",
    details="Eight hundredths of full thrust are always kept for steering.",
    decimals=2,
    increment=0.05,
)

TAKEOFF_AND_LAND = Group("Multicopter Position Control")

TAKEOFF_AND_LAND.real("MPC_TKO_SPEED", 1.5, (0.1, 5.0), "m/s", "Climb when taking off", decimals=2)
TAKEOFF_AND_LAND.real(
    "MPC_TKO_RAMP_T",
    3.0,
    (0.0, 5.0),
    "s",
    "Thrust rises for this long when taking off",
    details="Longer is gentler. 0: it jumps up.",
)
TAKEOFF_AND_LAND.real("MPC_LAND_SPEED", 0.7, (0.1, 3.0), "m/s", "Descent on the last metres of a landing")
TAKEOFF_AND_LAND.real(
    "MPC_LAND_ALT1",
    10.0,
    (0.0, 122.0),
    "m",
    "From this height down a landing becomes slower",
    details="It slows evenly until MPC_LAND_ALT2. Heights count from home.",
)
TAKEOFF_AND_LAND.real(
    "MPC_LAND_ALT2", 5.0, (0.0, 122.0), "m", "From this height down a landing sinks with MPC_LAND_SPEED"
)

HEADING = Group("Multicopter Attitude Control")

HEADING.choice(
    "MPC_YAW_MODE",
    0,
    {
        0: "Towards waypoint",
        1: "Towards home",
        2: "Away from home",
        3: "Along trajectory",
        4: "Towards waypoint (yaw first)",
        5: "Yaw fixed",
    },
    "Where it looks in modes that fly by themselves",
)
HEADING.real(
    "MPC_YAWRAUTO_MAX",
    60.0,
    (5.0, 360.0),
    "deg/s",
    "Yaw rate in modes that fly by themselves",
    decimals=0,
    increment=5,
)
