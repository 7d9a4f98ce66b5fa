"""The situation that the commander judges, and the conditions ("guards") of its table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum

from firmware_py.estimation.report import NO_FIX
from firmware_py.status import FlightMode
from framerunner.wire.dialect import mavlink

NEVER_US = -(10**15)
"""The time of what has never happened."""

_SETTLE_US = 800_000  # samples must be usable this long before arming
_SENSORS_LOST_US = 300_000
_POSITION_LOST_US = 1_000_000  # PX4: COM_POS_FS_DELAY, 1 s
_HEARTBEAT_US = 2_280_000  # PX4 1.17 acts so much later than COM_DL_LOSS_T after the last heartbeat
_BATTERY_LOW, _BATTERY_CRITICAL, _BATTERY_EMERGENCY = 2, 3, 4  # MAV_BATTERY_CHARGE_STATE


class Reaction(Enum):
    """What a failsafe does, in order of severity."""

    __hash__ = object.__hash__  # an enumeration's own is not compiled, and rows are looked up in each tick

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
"""Reactions after which an operator flies by the sticks."""


class FailsafeCause(Enum):
    """What a failsafe reacts to."""

    __hash__ = object.__hash__  # an enumeration's own is not compiled, and rows are looked up in each tick

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
    """Times of the parameters, microseconds; None: never."""

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
    """Choices of the parameters.

    Attributes:
        reactions: to each cause; NOTHING to a missing one.
        arm_needs_ground_station: no arming without a ground station.
        manual_ignored_in: modes in which the loss of manual control input is ignored.
        manual_disabled: there is no manual control at all.
        ground_station_ignored_in: modes in which the loss of the ground station is ignored.
        mission_after_takeoff: the mission follows a take-off, if there is one.
        tumbling_ends: a failed attitude ends the flight.
        without_sticks: replaces a reaction that needs the sticks when there is no manual control input.
    """

    reactions: dict[FailsafeCause, Reaction] = field(default_factory=dict)
    arm_needs_ground_station: bool = False
    manual_ignored_in: frozenset[FlightMode] = frozenset()
    manual_disabled: bool = False
    ground_station_ignored_in: frozenset[FlightMode] = frozenset({FlightMode.LAND})
    mission_after_takeoff: bool = False
    tumbling_ends: bool = True
    without_sticks: Reaction = Reaction.RETURN

    def reaction(self, cause: FailsafeCause) -> Reaction:
        """The reaction to a cause without manual control input."""
        chosen = self.reactions.get(cause, Reaction.NOTHING)
        return self.without_sticks if chosen in STICK_REACTIONS else chosen


@dataclass(slots=True)
class Situation:
    """What guards judge. Times are vehicle times in microseconds.

    Attributes:
        now_us: now.
        unusable_us: last missing or unusable sample.
        usable_us: last usable sample.
        position_us: last sample with a horizontal position.
        upright_us: last attitude within the limits of the failure detector.
        airborne_us: last time in the air.
        landed: on the ground.
        flown: in the air at any time since arming.
        target_reached: a take-off has reached its height.
        setpoint_us: last usable offboard setpoint.
        ground_station_us: last heartbeat of a ground station.
        manual_us: last manual control input.
        manual_missed: there was no manual control input at arming, so its absence is no loss.
        battery_warning: MAV_BATTERY_CHARGE_STATE, 1 ok to 4 emergency.
        battery_arms: the charge is enough to arm.
        battery_at_arming: the warning at arming; only a worse one counts.
        fence_breached: outside the geofence.
        problem: why the estimator's condition prevents arming, in words; empty: it does not.
        has_mission: there is a mission that can be flown.
        entered_us: when the present state was entered.
        armed_us: when the vehicle was armed.
        intended: the mode last requested.
        cause: of the active failsafe; None: none is active.
        follow_up: the reaction that follows a failsafe's hold.
        handled: causes that were reacted to and still exist.
        timeouts: of the parameters.
        choices: of the parameters.
    """

    now_us: int = 0
    unusable_us: int = 0
    usable_us: int = 0
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
    problem: str = ""
    has_mission: bool = False
    entered_us: int = 0
    armed_us: int = 0
    intended: FlightMode = FlightMode.HOLD
    cause: FailsafeCause | None = None
    follow_up: Reaction = Reaction.NOTHING
    handled: set[FailsafeCause] = field(default_factory=set)
    timeouts: Timeouts = field(default_factory=Timeouts)
    choices: Choices = field(default_factory=Choices)


Guard = Callable[[Situation], bool]


def unsettled(now: Situation) -> bool:
    """Samples have not been usable for long enough."""
    return now.now_us - now.unusable_us < _SETTLE_US


def estimator_fails(now: Situation) -> bool:
    """A sensor fails, or the estimator does not know what a flight in the intended mode needs."""
    return now.problem != "" and (now.problem != NO_FIX or now.intended not in POSITIONLESS)


def tipped_over(now: Situation) -> bool:
    """The attitude is beyond the limits of the failure detector."""
    return now.upright_us < now.now_us


def sensors_lost(now: Situation) -> bool:
    """No usable sample for too long."""
    return now.now_us - now.usable_us > _SENSORS_LOST_US


def sensors_lost_on_ground(now: Situation) -> bool:
    """The same, on the ground."""
    return now.landed and sensors_lost(now)


def tumbled(now: Situation) -> bool:
    """The attitude has failed for the time set."""
    return now.choices.tumbling_ends and now.now_us - now.upright_us > now.timeouts.tumble_us


def position_lost(now: Situation) -> bool:
    """No horizontal position for too long."""
    return now.now_us - now.position_us > _POSITION_LOST_US


def landed_after_flight(now: Situation) -> bool:
    """On the ground after a flight, for the time set."""
    wait_us = now.timeouts.disarm_landed_us
    return now.landed and now.flown and wait_us is not None and now.now_us - now.airborne_us >= wait_us


def landing_done(now: Situation) -> bool:
    """On the ground in a landing mode, for the time set."""
    wait_us = now.timeouts.disarm_landed_us
    return now.landed and wait_us is not None and now.now_us - max(now.airborne_us, now.entered_us) >= wait_us


def never_flown(now: Situation) -> bool:
    """Armed, and not in the air within the time set."""
    wait_us = now.timeouts.disarm_preflight_us
    return not now.flown and wait_us is not None and now.now_us - now.armed_us >= wait_us


def setpoint_lost(now: Situation) -> bool:
    """The last usable setpoint is too old."""
    return now.now_us - now.setpoint_us > now.timeouts.setpoint_loss_us


def offboard_back(now: Situation) -> bool:
    """Setpoints are received again after their loss."""
    return now.cause is FailsafeCause.SETPOINTS and not setpoint_lost(now)


def ground_station_lost(now: Situation) -> bool:
    """No ground station's heartbeat for the time set."""
    return now.now_us - now.ground_station_us > now.timeouts.ground_station_us + _HEARTBEAT_US


def ground_station_absent(now: Situation) -> bool:
    """Arming needs a ground station, and there is none."""
    return now.choices.arm_needs_ground_station and ground_station_lost(now)


def manual_lost(now: Situation) -> bool:
    """No manual control input for the time set."""
    return now.now_us - now.manual_us > now.timeouts.manual_us


def manual_present(now: Situation) -> bool:
    """Manual control input is being received."""
    return not manual_lost(now)


def battery_too_low(now: Situation) -> bool:
    """The charge is too low to arm."""
    return not now.battery_arms


def hold_over(now: Situation) -> bool:
    """A failsafe has held for its time."""
    return now.now_us - now.entered_us >= now.timeouts.failsafe_hold_us


def hold_over_on_ground(now: Situation) -> bool:
    """The same, on the ground."""
    return now.landed and now.follow_up is not Reaction.NOTHING and hold_over(now)


def hold_over_then(reaction: Reaction) -> Guard:
    """A guard: a failsafe has held for its time, and this reaction follows."""
    return lambda now: now.follow_up is reaction and hold_over(now)


def reacts(cause: FailsafeCause, reaction: Reaction) -> Guard:
    """A guard: the parameters choose this reaction to a cause."""
    return lambda now: now.choices.reaction(cause) is reaction


def reacts_with_sticks(cause: FailsafeCause, reaction: Reaction) -> Guard:
    """The same for a reaction that needs manual control input, which is received."""
    return lambda now: now.choices.reactions.get(cause, Reaction.NOTHING) is reaction and not manual_lost(now)


def target_reached(now: Situation) -> bool:
    """The take-off has reached its height."""
    return now.target_reached


def target_reached_with_mission(now: Situation) -> bool:
    """The same, and a mission follows."""
    return now.target_reached and now.choices.mission_after_takeoff and now.has_mission


def landed(now: Situation) -> bool:
    """On the ground."""
    return now.landed


def no_mission(now: Situation) -> bool:
    """There is no mission to fly."""
    return not now.has_mission


def intends(mode: FlightMode) -> Guard:
    """A guard: this mode is intended."""
    return lambda now: now.intended is mode


def intends_unarmable(now: Situation) -> bool:
    """The intended mode cannot be armed in."""
    return now.intended in UNARMABLE


def intends_offboard_without_setpoints(now: Situation) -> bool:
    """The intended mode is offboard, and no setpoints are received."""
    return now.intended is FlightMode.OFFBOARD and setpoint_lost(now)


def intends_manual_without_input(now: Situation) -> bool:
    """The intended mode is manual, and there is no manual control input."""
    return now.intended in MANUAL_MODES and manual_lost(now)


def intends_missing_mission(now: Situation) -> bool:
    """The intended mode is mission, and there is no valid one."""
    return now.intended is FlightMode.MISSION and not now.has_mission


def position_missing(now: Situation) -> bool:
    """The intended mode needs a position, and there is none."""
    return now.intended not in POSITIONLESS and position_lost(now)


MANUAL_MODES = frozenset(
    mode for mode in FlightMode if mode.value.flags & mavlink.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
)
"""Modes flown by the sticks."""

POSITIONLESS = MANUAL_MODES - {FlightMode.POSITION}
"""Modes that need no position."""

UNARMABLE = frozenset(
    {
        FlightMode.LAND,
        FlightMode.RETURN,
        FlightMode.ORBIT,
        FlightMode.FOLLOW,
        FlightMode.TERMINATION,
    }
)
"""Modes in which the vehicle cannot be armed, as in PX4."""


def next_cause(now: Situation) -> FailsafeCause | None:
    """The most severe cause that exists and was not reacted to yet; removes causes that are over."""
    handled = now.handled
    for cause, holds in _CAUSES:
        if holds(now):
            if cause not in handled:
                return cause
        elif handled:
            handled.discard(cause)
    return None


def _battery_at(level: int) -> Guard:
    return lambda now: now.battery_warning >= level > now.battery_at_arming


def _ground_station_gone(now: Situation) -> bool:
    if now.intended in now.choices.ground_station_ignored_in:
        return False
    return now.ground_station_us > NEVER_US and ground_station_lost(now)


def _manual_gone(now: Situation) -> bool:
    if now.choices.manual_disabled or now.manual_us == NEVER_US or not manual_lost(now):
        return False
    if now.intended in MANUAL_MODES:
        return True
    return not now.manual_missed and now.intended not in now.choices.manual_ignored_in


def _flight_time_over(now: Situation) -> bool:
    limit_us = now.timeouts.flight_us
    return limit_us is not None and now.flown and now.now_us - now.armed_us > limit_us


_CAUSES: tuple[tuple[FailsafeCause, Guard], ...] = (
    (FailsafeCause.POSITION, position_lost),
    (FailsafeCause.BATTERY_EMERGENCY, _battery_at(_BATTERY_EMERGENCY)),
    (FailsafeCause.BATTERY_CRITICAL, _battery_at(_BATTERY_CRITICAL)),
    (FailsafeCause.FENCE, lambda now: now.fence_breached),
    (FailsafeCause.MANUAL, _manual_gone),
    (FailsafeCause.GROUND_STATION, _ground_station_gone),
    (FailsafeCause.FLIGHT_TIME, _flight_time_over),
    (FailsafeCause.BATTERY_LOW, _battery_at(_BATTERY_LOW)),
)
