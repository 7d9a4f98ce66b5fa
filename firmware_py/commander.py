"""The commander: arming, modes and failsafes, by the table in `firmware_py.commander_table`."""

from __future__ import annotations

from dataclasses import replace
from math import nan
from typing import NamedTuple

from firmware_py.commander_guards import (
    Choices,
    FailsafeCause,
    Reaction,
    Situation,
    Timeouts,
    estimator_fails,
    next_cause,
    setpoint_lost,
)
from firmware_py.commander_table import (
    ARMING_DENIED,
    FLOWN_MODE,
    RULES,
    TICK_RULES,
    CommanderRow,
    CommanderState,
    Event,
    Trigger,
    first_match,
)
from firmware_py.guidance.orbit import Orbit
from firmware_py.parameters import Parameters
from firmware_py.status import CommandResult, FlightMode

_CHECK_PERIOD_US = 40_000  # of causes that are not urgent

_LINK_LOSS = (  # NAV_DLL_ACT and NAV_RCL_ACT
    Reaction.NOTHING,
    Reaction.HOLD,
    Reaction.RETURN,
    Reaction.LAND,
    Reaction.NOTHING,
    Reaction.TERMINATE,
    Reaction.DISARM,
)
_WITHOUT_STICKS = {
    2: Reaction.RETURN,
    3: Reaction.LAND,
    5: Reaction.TERMINATE,
    6: Reaction.DISARM,
}  # the same
_OFFBOARD_LOSS = (  # COM_OBL_RC_ACT
    Reaction.POSITION,
    Reaction.ALTITUDE,
    Reaction.STABILIZED,
    Reaction.RETURN,
    Reaction.LAND,
    Reaction.HOLD,
    Reaction.TERMINATE,
    Reaction.DISARM,
)
_FENCE = (  # GF_ACTION
    Reaction.NOTHING,
    Reaction.WARN,
    Reaction.HOLD,
    Reaction.RETURN,
    Reaction.TERMINATE,
    Reaction.LAND,
)
_BATTERY_CRITICAL = {0: Reaction.WARN, 2: Reaction.LAND, 3: Reaction.RETURN}  # COM_LOW_BAT_ACT
_BATTERY_EMERGENCY = {0: Reaction.WARN, 2: Reaction.LAND, 3: Reaction.LAND}
_EXCEPTIONS = (  # the bits of COM_RCL_EXCEPT and COM_DLL_EXCEPT
    frozenset({FlightMode.MISSION}),
    frozenset({FlightMode.HOLD, FlightMode.TAKEOFF}),
    frozenset({FlightMode.OFFBOARD}),
)
_MANUAL_DISABLED = 4  # COM_RC_IN_MODE
_TERMINATION_OFF = 121_212


class Observation(NamedTuple):
    """The vehicle in one control tick; immutable.

    Attributes:
        now_us: vehicle time.
        usable: this tick's sample is usable.
        has_position: the horizontal position is measured.
        upright: the attitude is within the limits of the failure detector.
        landed: on the ground.
        target_reached: a take-off has reached its height.
    """

    now_us: int
    usable: bool
    has_position: bool
    upright: bool
    landed: bool
    target_reached: bool


class Commander:
    """Keeps the state and the situation; the table decides.

    Attributes:
        state: of the table.
        situation: judged by the guards.
        takeoff_altitude_m: of the next take-off, above mean sea level; NaN: MIS_TAKEOFF_ALT above home.
        orbit: the circle to fly.
    """

    def __init__(self) -> None:
        self.state = CommanderState.DISARMED
        self._tick_rules = TICK_RULES[self.state]
        self._check_us = 0
        self._started = False
        self.situation = Situation()
        self.takeoff_altitude_m = nan
        self.orbit = Orbit()

    @property
    def mode(self) -> FlightMode:
        """The mode that is flown; disarmed: the intended one."""
        return FLOWN_MODE.get(self.state, self.situation.intended)

    @property
    def failsafe(self) -> bool:
        """Whether a failsafe chose the state."""
        return self.situation.cause is not None or self.state is CommanderState.TERMINATED

    @property
    def refusal(self) -> str:
        """Why the vehicle cannot be armed now; empty if it can."""
        row = first_match(RULES[CommanderState.DISARMED, Event.ARM], self.situation)
        if row is None or row.result is CommandResult.ACCEPTED:
            return ""
        return self._in_words(row)

    def tick(self, seen: Observation) -> CommanderRow | None:
        """Update the situation and apply the table once.

        Returns:
            The row that matched; None when nothing happens.
        """
        now_us, usable, has_position, upright, landed, target_reached = seen
        now = self.situation
        if not self._started:
            self._start(now_us)
        now.now_us = now_us
        if usable:
            now.usable_us = now_us
            if has_position:
                now.position_us = now_us
        else:
            now.unusable_us = now_us
        if upright:
            now.upright_us = now_us
        now.landed = landed
        if not landed:
            now.airborne_us = now_us
            now.flown = self.state is not CommanderState.DISARMED
        now.target_reached = target_reached
        for guard, rule in self._tick_rules:
            if guard(now):
                self._follow(rule)
                return rule
        row = None
        if self.state is CommanderState.OFFBOARD and setpoint_lost(now):
            row = self._react(FailsafeCause.SETPOINTS)
        elif now_us >= self._check_us:
            row = self._check(now_us)
        if row is not None:
            self._follow(row)
        return row

    def _start(self, now_us: int) -> None:
        self._started, now = True, self.situation
        now.unusable_us = now.usable_us = now.position_us = now.upright_us = now_us

    def note_checks(
        self,
        *,
        battery_warning: int,
        battery_arms: bool,
        has_mission: bool,
        fence_breached: bool,
        problem: str,
    ) -> None:
        """Note conditions that are checked ten times a second (`problem` while disarmed); see `Situation`."""
        now = self.situation
        now.battery_warning = battery_warning
        now.battery_arms = battery_arms
        now.has_mission = has_mission
        now.fence_breached = fence_breached
        now.problem = problem

    def _check(self, now_us: int) -> CommanderRow | None:
        self._check_us = now_us + _CHECK_PERIOD_US
        cause = None if self.state is CommanderState.DISARMED else next_cause(self.situation)
        return None if cause is None else self._react(cause)

    def _react(self, cause: FailsafeCause) -> CommanderRow | None:
        self.situation.handled.add(cause)
        return first_match(RULES[self.state, cause], self.situation)

    def handle(self, event: Trigger) -> CommanderRow:
        """Take a command, between ticks; the row that matched has the answer."""
        row = first_match(RULES[self.state, event], self.situation)
        if row is None:  # the table has an answer to every command; a test sweeps it
            raise LookupError(f"commander: no rule for {event} in {self.state.value}")
        self._follow(row)
        return replace(row, text=self._in_words(row)) if row.guard is estimator_fails else row

    def _in_words(self, row: CommanderRow) -> str:
        """A row's text; that of the estimator's condition is in the situation."""
        return f"{ARMING_DENIED}{self.situation.problem}" if row.guard is estimator_fails else row.text

    def remember(self, takeoff_altitude_m: float | None, orbit: Orbit | None) -> None:
        """Keep the arguments of a command; None: unchanged."""
        if takeoff_altitude_m is not None:
            self.takeoff_altitude_m = takeoff_altitude_m
        if orbit is not None:
            self.orbit = orbit

    def note_mission(self, *, valid: bool) -> None:
        """Note whether there is a mission that can be flown, between two slow checks."""
        self.situation.has_mission = valid

    def note_setpoint(self, time_us: int) -> None:
        """Note a usable offboard setpoint; a time in the future counts as now."""
        self.situation.setpoint_us = min(time_us, self.situation.now_us)

    def note_ground_station(self) -> None:
        """Note a ground station's heartbeat."""
        self.situation.ground_station_us = self.situation.now_us

    def note_manual_input(self) -> None:
        """Note manual control input."""
        now = self.situation
        now.manual_us = now.now_us
        now.manual_missed = False

    def configure(self, parameters: Parameters) -> None:
        """Apply times and choices of the parameters."""
        value, whole = parameters.value, parameters.integer
        self.situation.timeouts = Timeouts(
            setpoint_loss_us=_microseconds(value("COM_OF_LOSS_T")),
            failsafe_hold_us=_microseconds(value("COM_FAIL_ACT_T")),
            disarm_landed_us=_wait(value("COM_DISARM_LAND")),
            disarm_preflight_us=_wait(value("COM_DISARM_PRFLT")),
            ground_station_us=_microseconds(value("COM_DL_LOSS_T")),
            manual_us=_microseconds(value("COM_RC_LOSS_T")),
            tumble_us=_microseconds(value("FD_FAIL_P_TTRI")),
            flight_us=_wait(value("COM_FLT_TIME_MAX")),
        )
        self.situation.choices = Choices(
            reactions=_reactions(parameters),
            arm_needs_ground_station=whole("NAV_DLL_ACT") > 0,
            manual_ignored_in=_modes_of(whole("COM_RCL_EXCEPT")),
            ground_station_ignored_in=_modes_of(whole("COM_DLL_EXCEPT")) | {FlightMode.LAND},
            mission_after_takeoff=whole("COM_TAKEOFF_ACT") == 1,
            tumbling_ends=whole("CBRK_FLIGHTTERM") != _TERMINATION_OFF,
            manual_disabled=whole("COM_RC_IN_MODE") == _MANUAL_DISABLED,
            without_sticks=_WITHOUT_STICKS.get(whole("NAV_RCL_ACT"), Reaction.HOLD),
        )

    def _follow(self, row: CommanderRow) -> None:
        now = self.situation
        if row.intends is not None:
            now.intended = row.intends
        if row.target is None:
            return
        if self.state is CommanderState.DISARMED:
            now.armed_us = now.now_us
            now.flown = not now.landed
            now.manual_missed = now.now_us - now.manual_us > now.timeouts.manual_us
            now.battery_at_arming = now.battery_warning
            now.handled.clear()
        if row.event is not Event.TICK or row.target not in _LATER_STEPS:
            now.cause = row.cause  # a landing that follows a hold keeps its cause
        now.follow_up = row.follow_up
        self.state = row.target
        self._tick_rules = TICK_RULES[self.state]
        now.entered_us = now.now_us


_LATER_STEPS = frozenset({CommanderState.FAILSAFE_RETURN, CommanderState.FAILSAFE_LAND})


def _reactions(parameters: Parameters) -> dict[FailsafeCause, Reaction]:
    """The parameters' reaction to each cause."""
    whole = parameters.integer
    battery = whole("COM_LOW_BAT_ACT")
    return {
        FailsafeCause.SETPOINTS: _OFFBOARD_LOSS[whole("COM_OBL_RC_ACT")],
        FailsafeCause.GROUND_STATION: _LINK_LOSS[whole("NAV_DLL_ACT")],
        FailsafeCause.MANUAL: _LINK_LOSS[whole("NAV_RCL_ACT")],
        FailsafeCause.BATTERY_LOW: Reaction.WARN,
        FailsafeCause.BATTERY_CRITICAL: _BATTERY_CRITICAL.get(battery, Reaction.WARN),
        FailsafeCause.BATTERY_EMERGENCY: _BATTERY_EMERGENCY.get(battery, Reaction.WARN),
        FailsafeCause.FENCE: _FENCE[whole("GF_ACTION")],
        FailsafeCause.FLIGHT_TIME: Reaction.RETURN,
    }


def _modes_of(bits: int) -> frozenset[FlightMode]:
    """The modes of COM_RCL_EXCEPT or COM_DLL_EXCEPT."""
    return frozenset().union(*(modes for bit, modes in enumerate(_EXCEPTIONS) if bits >> bit & 1))


def _microseconds(seconds: float) -> int:
    return round(seconds * 1e6)


def _wait(seconds: float) -> int | None:
    return _microseconds(seconds) if seconds > 0 else None
