"""The battery: what it is, when it is low, and how its simulation drains."""

from __future__ import annotations

from firmware_py.parameters.declare import Group

BATTERY = Group("Battery Calibration")

BATTERY.real(
    "BAT1_CAPACITY",
    -1.0,
    (-1.0, 100_000.0),
    "mAh",
    "Charge of the full battery",
    details="-1: not known; the airframe's figure is taken where it has one.",
    decimals=0,
    increment=50,
    reboot=True,
)
BATTERY.choice(
    "BAT1_N_CELLS",
    4,
    {0: "Unknown", **{cells: f"{cells}S battery" for cells in range(1, 17)}},
    "Cells in series",
)
BATTERY.real(
    "BAT1_V_CHARGED",
    4.05,
    (3.0, 5.0),
    "V",
    "A cell at rest with this voltage is full",
    decimals=2,
    increment=0.01,
    reboot=True,
)
BATTERY.real(
    "BAT1_V_EMPTY",
    3.6,
    (2.0, 4.5),
    "V",
    "A cell at rest with this voltage is empty",
    decimals=2,
    increment=0.01,
    reboot=True,
)
BATTERY.real(
    "BAT1_R_INTERNAL",
    -1.0,
    (-1.0, 0.2),
    "Ohm",
    "Resistance of one cell, by which its voltage sags under load",
    details="-1: the battery model's own figure.",
    decimals=4,
    increment=0.0005,
    reboot=True,
)
BATTERY.fact("BAT1_SOURCE", 0, "Its figures come from the power module")
BATTERY.real(
    "BAT_LOW_THR",
    0.15,
    (0.12, 0.5),
    "norm",
    "With less charge than this the battery is low",
    details="A share of the full charge.",
    decimals=2,
    increment=0.01,
)
BATTERY.real(
    "BAT_CRIT_THR",
    0.07,
    (0.05, 0.5),
    "norm",
    "With less charge than this the battery is critical",
    details="Should be less than BAT_LOW_THR.",
    decimals=2,
    increment=0.01,
)
BATTERY.real(
    "BAT_EMERGEN_THR",
    0.05,
    (0.03, 0.5),
    "norm",
    "With less charge than this it must land now",
    details="Should be less than BAT_CRIT_THR.",
    decimals=2,
    increment=0.01,
)

SIMULATED_BATTERY = Group("SITL")

SIMULATED_BATTERY.real(
    "SIM_BAT_DRAIN",
    0.0,
    (0.0, 86_400.0),
    "s",
    "The simulated battery empties in this time while armed",
    details="0: by the current that the motors draw.",
    increment=1,
)
SIMULATED_BATTERY.real(
    "SIM_BAT_MIN_PCT",
    50.0,
    (0.0, 100.0),
    "%",
    "The simulated battery never has less charge than this",
    details="Lower it during a flight to try the battery failsafes.",
    increment=0.1,
)
