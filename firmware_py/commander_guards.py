"""What the commander looks at, and the conditions ("guards") its table is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

from firmware_py.status import FlightMode

NEVER_US = -(10**15)
"""The last time of what never happened."""

_SETTLE_US = 800_000  # sensors must be sound this long before arming
_SENSORS_LOST_US = 300_000
_POSITION_LOST_US = 1_000_000  # PX4: COM_POS_FS_DELAY, 1 s
_HEARTBEAT_US = 2_280_000  # so much later than COM_DL_LOSS_T after a last heartbeat does PX4 1.17 act
_BATTERY_LOW, _BATTERY_CRITICAL, _BATTERY_EMERGENCY = 2, 3, 4  # MAV_BATTERY_CHARGE_STATE


class Reaction(Enum):
    """What a failsafe does, from mild to severe."""

    NOTHING = "nothing"
    WARN = "warn"
    STABILIZED = "stabilized"
    ALTITUDE = "altitude"
    POSITION = "position"
    HOLD = "hold"
    RETURN = "return"
    LAND = "land"
    TERMINATE = "terminate"
    DISARM = "disarm"


STICK_REACTIONS = frozenset({Reaction.STABILIZED, Reaction.ALTITUDE, Reaction.POSITION})
"""Reactions that leave the vehicle to a pilot's sticks."""


class Cause(Enum):
    """What a failsafe reacts to."""

    SETPOINTS = "offboard setpoints lost"
    GROUND_STATION = "connection to ground station lost"
    MANUAL = "manual control lost"
    BATTERY_LOW = "battery low"
    BATTERY_CRITICAL = "battery critical"
    BATTERY_EMERGENCY = "battery nearly empty"
    FENCE = "geofence breached"
    POSITION = "position lost"
    FLIGHT_TIME = "flight time is over"


@dataclass(slots=True)
class Timeouts:
    """The times that parameters set, microseconds; None means never."""

    setpoint_loss_us: int = 1_000_000
    failsafe_hold_us: int = 5_000_000
    disarm_landed_us: int | None = 2_000_000
    disarm_preflight_us: int | None = 10_000_000
    ground_station_us: int = 10_000_000
    manual_us: int = 500_000
    tumble_us: int = 300_000
    flight_us: int | None = None


@dataclass(slots=True)
class Choices:
    """What parameters choose.

    Attributes:
        reactions: to each cause; one that is missing means nothing.
        arm_needs_ground_station: no arming unless a ground station is heard.
        manual_ignored_in: modes in which the loss of manual control is of no interest.
        manual_disabled: there is no manual control at all.
        ground_station_ignored_in: modes in which the loss of the ground station is of no interest.
        mission_after_takeoff: a take-off goes on with the mission if there is one.
        tumbling_ends: a failed attitude ends the flight.
        without_sticks: instead of a reaction that leaves the vehicle to sticks, when none come.
    """

    reactions: dict[Cause, Reaction] = field(default_factory=dict)
    arm_needs_ground_station: bool = False
    manual_ignored_in: frozenset[FlightMode] = frozenset()
    manual_disabled: bool = False
    ground_station_ignored_in: frozenset[FlightMode] = frozenset({FlightMode.LAND})
    mission_after_takeoff: bool = False
    tumbling_ends: bool = True
    without_sticks: Reaction = Reaction.RETURN

    def reaction(self, cause: Cause) -> Reaction:
        """What is done about a cause when no sticks come."""
        chosen = self.reactions.get(cause, Reaction.NOTHING)
        return self.without_sticks if chosen in STICK_REACTIONS else chosen


@dataclass(slots=True)
class Situation:
    """What guards look at. Times are vehicle times in microseconds.

    Attributes:
        now_us: now.
        unsound_us: when the last sample was missed or unusable.
        sound_us: when the last usable sample came.
        position_us: when the horizontal position was last known.
        upright_us: when its attitude was last one to fly in.
        airborne_us: when it last was in the air.
        landed: it stands on something.
        flown: it has been in the air since arming.
        target_reached: the take-off is at its height.
        setpoint_us: when the last usable offboard setpoint came.
        ground_station_us: when a ground station was last heard.
        manual_us: when the last sticks came.
        manual_missed: sticks were absent at arming, so nobody waits for them.
        battery_warning: MAV_BATTERY_CHARGE_STATE, 1 ok to 4 emergency.
        battery_arms: there is charge enough to arm.
        battery_at_arming: the warning when it was armed; only what is worse counts.
        fence_breached: it is outside the geofence.
        has_mission: there is a mission that can be flown.
        entered_us: when the present state was entered.
        armed_us: when it was armed.
        intended: the mode last asked for.
        cause: why a failsafe is in charge; None: it is not.
        follow_up: what a failsafe's hold turns into.
        handled: causes that were reacted to and still hold.
        timeouts: what parameters say.
        choices: what parameters say.
    """

    now_us: int = 0
    unsound_us: int = 0
    sound_us: int = 0
    position_us: int = 0
    upright_us: int = 0
    airborne_us: int = NEVER_US
    landed: bool = True
    flown: bool = False
    target_reached: bool = False
    setpoint_us: int = NEVER_US
    ground_station_us: int = NEVER_US
    manual_us: int = NEVER_US
    manual_missed: bool = True
    battery_warning: int = 1
    battery_arms: bool = True
    battery_at_arming: int = 1
    fence_breached: bool = False
    has_mission: bool = False
    entered_us: int = 0
    armed_us: int = 0
    intended: FlightMode = FlightMode.HOLD
    cause: Cause | None = None
    follow_up: Reaction = Reaction.NOTHING
    handled: set[Cause] = field(default_factory=set)
    timeouts: Timeouts = field(default_factory=Timeouts)
    choices: Choices = field(default_factory=Choices)


Guard = Callable[[Situation], bool]


def unsettled(now: Situation) -> bool:
    """Sensors have not been sound for long enough."""
    return now.now_us - now.unsound_us < _SETTLE_US


def tipped_over(now: Situation) -> bool:
    """It lies on its side."""
    return now.upright_us < now.now_us


def sensors_lost(now: Situation) -> bool:
    """No usable sample for too long to fly on the last one."""
    return now.now_us - now.sound_us > _SENSORS_LOST_US


def tumbled(now: Situation) -> bool:
    """Its attitude is beyond recovery."""
    return now.choices.tumbling_ends and now.now_us - now.upright_us > now.timeouts.tumble_us


def position_lost(now: Situation) -> bool:
    """The horizontal position is not known."""
    return now.now_us - now.position_us > _POSITION_LOST_US


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


def offboard_back(now: Situation) -> bool:
    """Setpoints come again after their loss."""
    return now.cause is Cause.SETPOINTS and not setpoint_lost(now)


def ground_station_lost(now: Situation) -> bool:
    """No ground station's heartbeat for the time set."""
    return now.now_us - now.ground_station_us > now.timeouts.ground_station_us + _HEARTBEAT_US


def ground_station_absent(now: Situation) -> bool:
    """A ground station must be there to arm, and is not."""
    return now.choices.arm_needs_ground_station and ground_station_lost(now)


def manual_lost(now: Situation) -> bool:
    """No sticks for the time set."""
    return now.now_us - now.manual_us > now.timeouts.manual_us


def manual_present(now: Situation) -> bool:
    """Manual control input is being received."""
    return not manual_lost(now)


def battery_too_low(now: Situation) -> bool:
    """The battery is too low to take off with."""
    return not now.battery_arms


def hold_over(now: Situation) -> bool:
    """The failsafe has held for its time."""
    return now.now_us - now.entered_us >= now.timeouts.failsafe_hold_us


def hold_over_on_ground(now: Situation) -> bool:
    """The same, standing."""
    return now.landed and now.follow_up is not Reaction.NOTHING and hold_over(now)


def hold_over_then(reaction: Reaction) -> Guard:
    """A guard: the failsafe has held for its time, and this comes next."""

    def guard(now: Situation) -> bool:
        return now.follow_up is reaction and hold_over(now)

    guard.__name__ = f"hold_over_then_{reaction.value}"
    return guard


def reacts(cause: Cause, reaction: Reaction) -> Guard:
    """A guard: parameters choose this reaction to that cause."""

    def guard(now: Situation) -> bool:
        return now.choices.reaction(cause) is reaction

    guard.__name__ = f"chosen_{reaction.value}"
    return guard


def reacts_with_sticks(cause: Cause, reaction: Reaction) -> Guard:
    """The same for a reaction that leaves the vehicle to a pilot's sticks: they must be there."""

    def guard(now: Situation) -> bool:
        return now.choices.reactions.get(cause, Reaction.NOTHING) is reaction and not manual_lost(now)

    guard.__name__ = f"chosen_{reaction.value}_with_sticks"
    return guard


def target_reached(now: Situation) -> bool:
    """The take-off is at its height."""
    return now.target_reached


def target_reached_with_mission(now: Situation) -> bool:
    """The same, and a mission is to follow."""
    return now.target_reached and now.choices.mission_after_takeoff and now.has_mission


def landed(now: Situation) -> bool:
    """It stands on something."""
    return now.landed


def no_mission(now: Situation) -> bool:
    """There is no mission to fly."""
    return not now.has_mission


def intends(mode: FlightMode) -> Guard:
    """A guard: this mode was chosen."""

    def guard(now: Situation) -> bool:
        return now.intended is mode

    guard.__name__ = f"intends_{mode.name.lower()}"
    return guard


def intends_unarmable(now: Situation) -> bool:
    """The mode chosen is one that cannot be armed in."""
    return now.intended in UNARMABLE


def intends_offboard_unfed(now: Situation) -> bool:
    """The mode chosen is offboard, and no setpoints come."""
    return now.intended is FlightMode.OFFBOARD and setpoint_lost(now)


def intends_manual_unmanned(now: Situation) -> bool:
    """The mode chosen is flown by hand, and no sticks come."""
    return now.intended in MANUAL_MODES and manual_lost(now)


def intends_mission_without(now: Situation) -> bool:
    """The mode chosen is mission, and there is none."""
    return now.intended is FlightMode.MISSION and not now.has_mission


def needs_position_in_vain(now: Situation) -> bool:
    """The mode chosen needs a position, and there is none."""
    return now.intended not in POSITIONLESS and position_lost(now)


MANUAL_MODES = frozenset(
    {
        FlightMode.MANUAL,
        FlightMode.ALTITUDE,
        FlightMode.POSITION,
        FlightMode.ACRO,
        FlightMode.STABILIZED,
    }
)
"""Modes flown by hand."""

POSITIONLESS = MANUAL_MODES - {FlightMode.POSITION}
"""Modes that can be flown without knowing where one is."""

UNARMABLE = frozenset(
    {
        FlightMode.LAND,
        FlightMode.RETURN,
        FlightMode.ORBIT,
        FlightMode.FOLLOW,
        FlightMode.TERMINATION,
    }
)
"""Modes that cannot be armed in, as in PX4."""


def trouble(now: Situation) -> Cause | None:
    """The first cause, severe ones first, that holds and was not reacted to yet; forgets what is over."""
    handled = now.handled
    for cause, holds in _TROUBLES:
        if holds(now):
            if cause not in handled:
                return cause
        elif handled:
            handled.discard(cause)
    return None


def _battery_at(level: int) -> Guard:
    def guard(now: Situation) -> bool:
        return now.battery_warning >= level > now.battery_at_arming

    return guard


def _ground_station_went(now: Situation) -> bool:
    if now.intended in now.choices.ground_station_ignored_in:
        return False
    return now.ground_station_us > NEVER_US and ground_station_lost(now)


def _manual_went(now: Situation) -> bool:
    if now.choices.manual_disabled or now.manual_us == NEVER_US or not manual_lost(now):
        return False
    if now.intended in MANUAL_MODES:
        return True
    return not now.manual_missed and now.intended not in now.choices.manual_ignored_in


def _flight_time_over(now: Situation) -> bool:
    limit_us = now.timeouts.flight_us
    return limit_us is not None and now.flown and now.now_us - now.armed_us > limit_us


def _fence_breached(now: Situation) -> bool:
    return now.fence_breached


_TROUBLES: tuple[tuple[Cause, Guard], ...] = (
    (Cause.POSITION, position_lost),
    (Cause.BATTERY_EMERGENCY, _battery_at(_BATTERY_EMERGENCY)),
    (Cause.BATTERY_CRITICAL, _battery_at(_BATTERY_CRITICAL)),
    (Cause.FENCE, _fence_breached),
    (Cause.MANUAL, _manual_went),
    (Cause.GROUND_STATION, _ground_station_went),
    (Cause.FLIGHT_TIME, _flight_time_over),
    (Cause.BATTERY_LOW, _battery_at(_BATTERY_LOW)),
)
