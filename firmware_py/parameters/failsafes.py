"""What it does by itself when a link, the battery's charge or its upright attitude is lost."""

from __future__ import annotations

from firmware_py.parameters.declare import Group

_AFTER_HOLD = "It first holds for COM_FAIL_ACT_T, so that a pilot can take over."

FAILSAFES = Group("Commander")

FAILSAFES.real(
    "COM_FAIL_ACT_T",
    5.0,
    (0.0, 25.0),
    "s",
    "A failsafe holds this long before it acts",
    details="Meanwhile a pilot can choose another mode. 0: it acts at once.",
)
FAILSAFES.real(
    "COM_OF_LOSS_T",
    1.0,
    (0.0, 60.0),
    "s",
    "Offboard setpoints older than this count as lost",
    decimals=2,
    increment=0.01,
)
FAILSAFES.choice(
    "COM_OBL_RC_ACT",
    0,
    {
        0: "Position mode",
        1: "Altitude mode",
        2: "Stabilized",
        3: "Return mode",
        4: "Land mode",
        5: "Hold mode",
        6: "Terminate",
        7: "Disarm",
    },
    "What it does when offboard setpoints stop",
    "The first three need a pilot at the sticks; without one, NAV_RCL_ACT is done instead.",
)
FAILSAFES.whole(
    "COM_DL_LOSS_T",
    10,
    (5, 300),
    "s",
    "A ground station that was not heard for this long is lost",
    increment=1,
)
FAILSAFES.choice(
    "NAV_DLL_ACT",
    0,
    {
        0: "Disabled",
        1: "Hold mode",
        2: "Return mode",
        3: "Land mode",
        5: "Terminate",
        6: "Disarm",
    },
    "What it does when the ground station is lost",
    _AFTER_HOLD + " If it is not 0, arming needs a ground station.",
)
FAILSAFES.mask(
    "COM_DLL_EXCEPT",
    0,
    {0: "Mission", 1: "Hold", 2: "Offboard"},
    "Modes that go on without a ground station",
)
FAILSAFES.choice(
    "NAV_RCL_ACT",
    2,
    {1: "Hold mode", 2: "Return mode", 3: "Land mode", 5: "Terminate", 6: "Disarm"},
    "What it does when the sticks are lost",
    _AFTER_HOLD + " Sticks that were missing at arming already are not lost.",
)
FAILSAFES.mask(
    "COM_RCL_EXCEPT",
    0,
    {0: "Mission", 1: "Hold", 2: "Offboard", 3: "External mode", 4: "Altitude cruise"},
    "Modes that go on without sticks",
)
FAILSAFES.choice(
    "COM_LOW_BAT_ACT",
    3,
    {0: "Warning", 2: "Land mode", 3: "Return at critical level, land at emergency level"},
    "What it does when the battery is nearly empty",
    "The levels are BAT_CRIT_THR and BAT_EMERGEN_THR. At BAT_LOW_THR it only warns.",
)

FAILURES = Group("Failure Detector")

FAILURES.whole(
    "FD_FAIL_R", 60, (0, 180), "deg", "Rolled further than this it has tumbled", details="0: no such check."
)
FAILURES.whole(
    "FD_FAIL_P", 60, (0, 180), "deg", "Pitched further than this it has tumbled", details="0: no such check."
)
FAILURES.real(
    "FD_FAIL_P_TTRI",
    0.3,
    (0.02, 5.0),
    "s",
    "For this long it may be pitched further than FD_FAIL_P",
    decimals=2,
)

BREAKERS = Group("Circuit Breaker")

BREAKERS.whole(
    "CBRK_FLIGHTTERM",
    0,
    (0, 121_212),
    "",
    "121212 keeps a failed attitude from terminating the flight",
    details="PX4's default. Termination on command, by a fence or by a lost link happens all the same.",
    reboot=True,
)
BREAKERS.whole(
    "CBRK_SUPPLY_CHK",
    0,
    (0, 894_281),
    "",
    "894281 leaves the battery out of the checks before arming",
)
BREAKERS.fact("CBRK_IO_SAFETY", 22_027, "There is no safety switch")
BREAKERS.fact("CBRK_USB_CHK", 197_848, "There is no USB plug to be left in")
