"""What the commander looks at, and the conditions ("guards") its table is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from firmware_py.status import FlightMode

NEVER_US = -(10**15)
"""The last time of what never happened."""

_SETTLE_US = 800_000  # sensors must be sound this long before arming
_SENSORS_LOST_US = 300_000
_TUMBLED_US = 300_000


@dataclass(slots=True)
class Timeouts:
    """The times that parameters set, microseconds; None means never."""

    setpoint_loss_us: int = 1_000_000
    failsafe_hold_us: int = 5_000_000
    disarm_landed_us: int | None = 2_000_000
    disarm_preflight_us: int | None = 10_000_000
    land_at_loss: bool = False


@dataclass(slots=True)
class Situation:
    """What guards look at. Times are vehicle times in microseconds.

    Attributes:
        now_us: now.
        unsound_us: when the last sample was missed or unusable.
        sound_us: when the last usable sample came.
        upright_us: when its attitude was last one to fly in.
        airborne_us: when it last was in the air.
        landed: it stands on something.
        flown: it has been in the air since arming.
        target_reached: the take-off is at its height.
        setpoint_us: when the last usable offboard setpoint came.
        entered_us: when the present state was entered.
        armed_us: when it was armed.
        intended: the mode last asked for.
        timeouts: what parameters say.
    """

    now_us: int = 0
    unsound_us: int = 0
    sound_us: int = 0
    upright_us: int = 0
    airborne_us: int = NEVER_US
    landed: bool = True
    flown: bool = False
    target_reached: bool = False
    setpoint_us: int = NEVER_US
    entered_us: int = 0
    armed_us: int = 0
    intended: FlightMode = FlightMode.HOLD
    timeouts: Timeouts = field(default_factory=Timeouts)


Guard = Callable[[Situation], bool]


def unhealthy(now: Situation) -> bool:
    """Sensors are not settled, or it lies on its side."""
    return now.now_us - now.unsound_us < _SETTLE_US or now.upright_us < now.now_us


def sensors_lost(now: Situation) -> bool:
    """No usable sample for too long to fly on the last one."""
    return now.now_us - now.sound_us > _SENSORS_LOST_US


def tumbled(now: Situation) -> bool:
    """Its attitude is beyond recovery."""
    return now.now_us - now.upright_us > _TUMBLED_US


def landed_after_flight(now: Situation) -> bool:
    """It has flown and stands for the time set."""
    wait_us = now.timeouts.disarm_landed_us
    return now.landed and now.flown and wait_us is not None and now.now_us - now.airborne_us >= wait_us


def landing_done(now: Situation) -> bool:
    """It was told to land where it stands already, and the time set is over."""
    wait_us = now.timeouts.disarm_landed_us
    return now.landed and wait_us is not None and now.now_us - max(now.airborne_us, now.entered_us) >= wait_us


def never_flown(now: Situation) -> bool:
    """It was armed and did not take off within the time set."""
    wait_us = now.timeouts.disarm_preflight_us
    return not now.flown and wait_us is not None and now.now_us - now.armed_us >= wait_us


def setpoint_lost(now: Situation) -> bool:
    """The last usable setpoint is too old."""
    return now.now_us - now.setpoint_us > now.timeouts.setpoint_loss_us


def setpoint_lost_land(now: Situation) -> bool:
    """The same, and a parameter says to land at once."""
    return now.timeouts.land_at_loss and setpoint_lost(now)


def setpoint_fresh(now: Situation) -> bool:
    """Setpoints come."""
    return not setpoint_lost(now)


def hold_over(now: Situation) -> bool:
    """The failsafe has held for its time."""
    return now.now_us - now.entered_us >= now.timeouts.failsafe_hold_us


def hold_over_on_ground(now: Situation) -> bool:
    """The same, standing."""
    return now.landed and hold_over(now)


def target_reached(now: Situation) -> bool:
    """The take-off is at its height."""
    return now.target_reached


def landed(now: Situation) -> bool:
    """It stands on something."""
    return now.landed


def intends_land(now: Situation) -> bool:
    """The mode chosen is one that cannot be armed in."""
    return now.intended is FlightMode.LAND


def intends_takeoff(now: Situation) -> bool:
    """The mode chosen is take-off."""
    return now.intended is FlightMode.TAKEOFF


def intends_offboard(now: Situation) -> bool:
    """The mode chosen is offboard."""
    return now.intended is FlightMode.OFFBOARD


def intends_offboard_unfed(now: Situation) -> bool:
    """The mode chosen is offboard, and no setpoints come."""
    return now.intended is FlightMode.OFFBOARD and setpoint_lost(now)
