"""The commander's state machine as a table: what each event does in each state.

Rows are tried from the top and the first match counts, so failsafes come first. Nothing here keeps state
or acts; `firmware_py.commander` does. Texts and results are PX4's wherever PX4 has the same case.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from firmware_py import commander_guards as when
from firmware_py.commander_guards import MANUAL_MODES, FailsafeCause, Guard, Reaction, Situation
from firmware_py.status import CommandResult, FlightMode
from firmware_py.types import CRITICAL, INFO, WARNING


class CommanderState(Enum):
    """Disarmed, or the mode that is flown, and whether a failsafe chose it."""

    DISARMED = "disarmed"
    MANUAL = "manual"
    STABILIZED = "stabilized"
    ACRO = "acro"
    ALTITUDE = "altitude"
    POSITION = "position"
    HOLD = "hold"
    TAKEOFF = "takeoff"
    ORBIT = "orbit"
    FOLLOW = "follow"
    MISSION = "mission"
    RETURN = "return"
    LAND = "land"
    OFFBOARD = "offboard"
    FAILSAFE_HOLD = "failsafe_hold"
    FAILSAFE_RETURN = "failsafe_return"
    FAILSAFE_LAND = "failsafe_land"
    FAILSAFE_DESCEND = "failsafe_descend"  # without a position
    TERMINATED = "terminated"  # motors stopped, also in the air


class Event(Enum):
    """Commands and ends of modes; all other conditions are guards on TICK."""

    TICK = "tick"
    ARM = "arm"
    DISARM = "disarm"
    FORCE_DISARM = "force_disarm"
    STICKS_TAKE_OVER = "sticks_take_over"
    MISSION_DONE = "mission_done"
    MISSION_RETURNS = "mission_returns"


Trigger = Event | FlightMode | FailsafeCause
"""What a row applies to: an event, the request of a mode, or the cause of a failsafe."""

FLOWN_MODE: dict[CommanderState, FlightMode] = {
    **{state: FlightMode[state.name] for state in CommanderState if state.name in FlightMode.__members__},
    CommanderState.FAILSAFE_HOLD: FlightMode.HOLD,
    CommanderState.FAILSAFE_RETURN: FlightMode.RETURN,
    CommanderState.FAILSAFE_LAND: FlightMode.LAND,
    CommanderState.FAILSAFE_DESCEND: FlightMode.LAND,
    CommanderState.TERMINATED: FlightMode.TERMINATION,
}
"""The flight mode of each armed state."""


@dataclass(frozen=True, slots=True)
class CommanderRow:
    """One rule. Entering DISARMED stops the motors; leaving it sets home.

    Attributes:
        states: in which it applies.
        event: to which it applies, see `Trigger`.
        guard: condition; None: always.
        target: the next state; None: stay, and the mode continues unchanged.
        intends: the new intended mode; None: unchanged.
        result: the answer to a command.
        severity: MAV_SEVERITY of the text.
        text: for people; empty: none.
        follow_up: the reaction that follows the failsafe's hold.
    """

    states: frozenset[CommanderState]
    event: Trigger
    guard: Guard | None = None
    target: CommanderState | None = None
    intends: FlightMode | None = None
    result: CommandResult = CommandResult.ACCEPTED
    severity: int = INFO
    text: str = ""
    follow_up: Reaction = Reaction.NOTHING

    @property
    def cause(self) -> FailsafeCause | None:
        """Of a failsafe; None: the target is entered for another reason."""
        return self.event if isinstance(self.event, FailsafeCause) else None


def _at(*states: CommanderState) -> frozenset[CommanderState]:
    return frozenset(states)


def _tick(
    states: frozenset[CommanderState],
    guard: Guard,
    target: CommanderState,
    text: str = "",
    *,
    severity: int = INFO,
    intends: FlightMode | None = None,
) -> CommanderRow:
    return CommanderRow(states, Event.TICK, guard, target, intends, severity=severity, text=text)


def _stop(
    states: frozenset[CommanderState], guard: Guard, text: str, *, severity: int = INFO
) -> CommanderRow:
    return _tick(states, guard, CommanderState.DISARMED, text, severity=severity, intends=FlightMode.HOLD)


def _fail(
    states: frozenset[CommanderState],
    event: Trigger,
    guard: Guard | None,
    target: CommanderState,
    text: str,
    *,
    follow_up: Reaction = Reaction.NOTHING,
) -> CommanderRow:
    return CommanderRow(states, event, guard, target, severity=CRITICAL, text=text, follow_up=follow_up)


def _refuse(
    states: frozenset[CommanderState], event: Trigger, guard: Guard | None, text: str
) -> CommanderRow:
    return CommanderRow(
        states, event, guard, result=CommandResult.TEMPORARILY_REJECTED, severity=CRITICAL, text=text
    )


_OFF = _at(CommanderState.DISARMED)
_ARMED = frozenset(FLOWN_MODE)
_FLYING = _ARMED - _at(CommanderState.TERMINATED)
_DOWNWARD = _at(CommanderState.LAND, CommanderState.FAILSAFE_LAND, CommanderState.FAILSAFE_DESCEND)
_HOMEWARD = _at(CommanderState.RETURN, CommanderState.FAILSAFE_RETURN)
_LANDING = _DOWNWARD | _HOMEWARD
BY_HAND = _at(
    CommanderState.MANUAL,
    CommanderState.STABILIZED,
    CommanderState.ACRO,
    CommanderState.ALTITUDE,
    CommanderState.POSITION,
)
"""States flown by the sticks."""
_BLIND = _at(
    CommanderState.MANUAL, CommanderState.STABILIZED, CommanderState.ACRO, CommanderState.ALTITUDE
)  # no position needed

_HARD_FAILURES = (
    _stop(_FLYING, when.sensors_lost_on_ground, "Sensors lost: motors stopped", severity=CRITICAL),
    _tick(
        _FLYING,
        when.sensors_lost,
        CommanderState.TERMINATED,
        "Sensors lost: flight terminated",
        severity=CRITICAL,
    ),
    _tick(
        _FLYING,
        when.tumbled,
        CommanderState.TERMINATED,
        "Attitude failure: flight terminated",
        severity=CRITICAL,
    ),
    _stop(_ARMED, when.landed_after_flight, "Disarmed by landing"),
    _stop(_LANDING, when.landing_done, "Disarmed by landing"),
    _stop(_FLYING, when.never_flown, "Disarmed by auto preflight disarming"),
    _tick(
        _FLYING, when.offboard_back, CommanderState.OFFBOARD, "Offboard setpoints are back: offboard resumed"
    ),
    _stop(
        _at(CommanderState.FAILSAFE_HOLD), when.hold_over_on_ground, "Disarmed by failsafe", severity=CRITICAL
    ),
)

_STEPS = {
    Reaction.HOLD: (CommanderState.FAILSAFE_HOLD, _FLYING - _LANDING - _at(CommanderState.FAILSAFE_HOLD)),
    Reaction.RETURN: (CommanderState.FAILSAFE_RETURN, _FLYING - _LANDING),
    Reaction.LAND: (CommanderState.FAILSAFE_LAND, _FLYING - _DOWNWARD),
    Reaction.TERMINATE: (CommanderState.TERMINATED, _FLYING),
    Reaction.DISARM: (CommanderState.DISARMED, _FLYING),
}
"""The target of each reaction, and the states from which it is entered: none that are more severe."""

_STICKS = {
    Reaction.STABILIZED: CommanderState.STABILIZED,
    Reaction.ALTITUDE: CommanderState.ALTITUDE,
    Reaction.POSITION: CommanderState.POSITION,
}

_DOING = {Reaction.RETURN: "returning home", Reaction.LAND: "landing"}
_DELAYED = (FailsafeCause.GROUND_STATION, FailsafeCause.MANUAL)
"""Causes that may end: PX4 holds for COM_FAIL_ACT_T before it acts."""


def _hold_ends(reaction: Reaction) -> CommanderRow:
    target, _ = _STEPS[reaction]
    guard = when.hold_over_then(reaction)
    return _fail(
        _at(CommanderState.FAILSAFE_HOLD), Event.TICK, guard, target, f"Failsafe: {_DOING[reaction]}"
    )


def _reactions(cause: FailsafeCause, *, from_sticks: bool = False) -> tuple[CommanderRow, ...]:
    """The rows of one cause: each reaction, in the states in which it is more severe."""
    rows = []
    alarm = f"Failsafe activated: {cause.value}"
    if from_sticks:
        for reaction, target in _STICKS.items():
            guard = when.reacts_with_sticks(cause, reaction)
            rows.append(_fail(_FLYING - _LANDING, cause, guard, target, f"{alarm}, {reaction.value}"))
    for reaction, (target, states) in _STEPS.items():
        delayed = cause in _DELAYED and reaction in {Reaction.RETURN, Reaction.LAND}
        if cause is FailsafeCause.SETPOINTS and reaction is Reaction.HOLD:
            follow_up = Reaction.LAND  # the app is gone; see docs/px4-compatibility.md
        else:
            follow_up = reaction if delayed else Reaction.NOTHING
        rows.append(
            _fail(
                states - _HOMEWARD - _at(CommanderState.FAILSAFE_HOLD) if delayed else states,
                cause,
                when.reacts(cause, reaction),
                CommanderState.FAILSAFE_HOLD if delayed else target,
                f"{alarm}, {'hold, then ' if delayed else ''}{reaction.value}",
                follow_up=follow_up,
            )
        )
    warns = when.reacts(cause, Reaction.WARN)
    rows.append(CommanderRow(_FLYING, cause, warns, severity=WARNING, text=f"Warning: {cause.value}"))
    rows.append(CommanderRow(frozenset(CommanderState), cause))
    return tuple(rows)


_MANUAL_NOT_THERE = _fail(
    BY_HAND,
    FailsafeCause.MANUAL,
    when.reacts(FailsafeCause.MANUAL, Reaction.NOTHING),
    CommanderState.FAILSAFE_HOLD,
    f"Failsafe activated: {FailsafeCause.MANUAL.value}, hold",
)

_POSITION_LOST = (
    _fail(
        _at(CommanderState.POSITION),
        FailsafeCause.POSITION,
        when.manual_present,
        CommanderState.ALTITUDE,
        "Position lost: altitude mode",
    ),
    _fail(
        _FLYING - _BLIND - _at(CommanderState.FAILSAFE_DESCEND),
        FailsafeCause.POSITION,
        None,
        CommanderState.FAILSAFE_DESCEND,
        "Failsafe activated: position lost, descending",
    ),
    CommanderRow(frozenset(CommanderState), FailsafeCause.POSITION),
)

_FAILSAFES = (
    _HARD_FAILURES
    + tuple(_hold_ends(reaction) for reaction in (Reaction.RETURN, Reaction.LAND))
    + _POSITION_LOST
    + _reactions(FailsafeCause.SETPOINTS, from_sticks=True)
    + (_MANUAL_NOT_THERE,)
    + tuple(
        row
        for cause in FailsafeCause
        if cause not in {FailsafeCause.SETPOINTS, FailsafeCause.POSITION}
        for row in _reactions(cause)
    )
)

_PROGRESS = (
    _tick(
        _at(CommanderState.TAKEOFF),
        when.target_reached_with_mission,
        CommanderState.MISSION,
        intends=FlightMode.MISSION,
    ),
    _tick(_at(CommanderState.TAKEOFF), when.target_reached, CommanderState.HOLD, intends=FlightMode.HOLD),
    CommanderRow(_at(CommanderState.MISSION), Event.MISSION_DONE, None, CommanderState.HOLD, FlightMode.HOLD),
    CommanderRow(frozenset(CommanderState), Event.MISSION_DONE),
    CommanderRow(
        _at(CommanderState.MISSION), Event.MISSION_RETURNS, None, CommanderState.RETURN, FlightMode.RETURN
    ),
    CommanderRow(frozenset(CommanderState), Event.MISSION_RETURNS),
    CommanderRow(
        _FLYING - BY_HAND,
        Event.STICKS_TAKE_OVER,
        None,
        CommanderState.POSITION,
        FlightMode.POSITION,
        text="Pilot took over using sticks",
    ),
    CommanderRow(frozenset(CommanderState), Event.STICKS_TAKE_OVER),
)

ARMING_DENIED = "Arming denied: "
"""Before the reason."""
_ARMED_TEXT = "Armed by external command"
_DISARMED_TEXT = "Disarmed by external command"

_ARMING = (
    _refuse(_OFF, Event.ARM, when.estimator_fails, ARMING_DENIED + "the estimator is not ready"),
    _refuse(_OFF, Event.ARM, when.unsettled, ARMING_DENIED + "Resolve system health failures first"),
    _refuse(_OFF, Event.ARM, when.tipped_over, ARMING_DENIED + "vehicle is tipped over"),
    _refuse(_OFF, Event.ARM, when.position_missing, ARMING_DENIED + "no position estimate"),
    _refuse(_OFF, Event.ARM, when.battery_too_low, ARMING_DENIED + "low battery"),
    _refuse(
        _OFF, Event.ARM, when.ground_station_absent, ARMING_DENIED + "no connection to the ground station"
    ),
    _refuse(_OFF, Event.ARM, when.intends_unarmable, ARMING_DENIED + "not in this mode"),
    _refuse(
        _OFF, Event.ARM, when.intends_offboard_without_setpoints, ARMING_DENIED + "no offboard setpoints"
    ),
    _refuse(_OFF, Event.ARM, when.intends_manual_without_input, ARMING_DENIED + "no manual control input"),
    _refuse(_OFF, Event.ARM, when.intends_missing_mission, ARMING_DENIED + "no valid mission"),
    *(
        CommanderRow(_OFF, Event.ARM, when.intends(mode), state, text=_ARMED_TEXT)
        for state, mode in FLOWN_MODE.items()
        if mode not in when.UNARMABLE and state not in {CommanderState.HOLD, CommanderState.FAILSAFE_HOLD}
    ),
    CommanderRow(_OFF, Event.ARM, None, CommanderState.HOLD, text=_ARMED_TEXT),
    CommanderRow(_ARMED, Event.ARM),
    CommanderRow(_OFF, Event.DISARM),
    CommanderRow(
        _ARMED, Event.DISARM, when.landed, CommanderState.DISARMED, FlightMode.HOLD, text=_DISARMED_TEXT
    ),
    CommanderRow(
        _at(CommanderState.TERMINATED),
        Event.DISARM,
        None,
        CommanderState.DISARMED,
        FlightMode.HOLD,
        text=_DISARMED_TEXT,
    ),
    _refuse(_ARMED, Event.DISARM, None, "Disarming denied: not landed"),
    CommanderRow(_OFF, Event.FORCE_DISARM),
    CommanderRow(
        _ARMED, Event.FORCE_DISARM, None, CommanderState.DISARMED, FlightMode.HOLD, text=_DISARMED_TEXT
    ),
    CommanderRow(_OFF, FlightMode.TERMINATION),
    CommanderRow(_at(CommanderState.TERMINATED), FlightMode.TERMINATION),
    CommanderRow(
        _FLYING,
        FlightMode.TERMINATION,
        None,
        CommanderState.TERMINATED,
        severity=CRITICAL,
        text="Flight terminated",
    ),
)


def _unavailable(mode: FlightMode) -> str:
    return f"Switching to {mode.name.capitalize()} is currently not available"


_AFTER_TERMINATION = tuple(
    _refuse(_at(CommanderState.TERMINATED), mode, None, "Mode change refused: flight terminated")
    for mode in FlightMode
    if mode is not FlightMode.TERMINATION
)
_NEEDS_STICKS = tuple(
    _refuse(_FLYING, mode, when.manual_lost, f"{_unavailable(mode)}: no manual control")
    for mode in FlightMode
    if mode in MANUAL_MODES
)
_NEEDS_POSITION = tuple(
    _refuse(_FLYING, mode, when.position_lost, f"{_unavailable(mode)}: no position")
    for mode in FlightMode
    if mode not in when.POSITIONLESS
    and mode not in {FlightMode.TERMINATION, FlightMode.OFFBOARD, FlightMode.LAND}
)
_STAYS = (
    CommanderState.HOLD,
    CommanderState.LAND,
    CommanderState.RETURN,
    CommanderState.MISSION,
    CommanderState.OFFBOARD,
    *sorted(BY_HAND, key=lambda s: s.value),
)
_SETS = tuple(
    row
    for state, mode in FLOWN_MODE.items()
    if state.name == mode.name
    for row in (
        CommanderRow(_OFF, mode, intends=mode),
        *((CommanderRow(_at(state), mode, intends=mode),) if state in _STAYS else ()),
        CommanderRow(_FLYING, mode, None, state, mode),
    )
)

_MODES = (
    *_AFTER_TERMINATION,
    *_NEEDS_STICKS,
    *_NEEDS_POSITION,
    _refuse(
        _FLYING - _at(CommanderState.OFFBOARD),
        FlightMode.OFFBOARD,
        when.setpoint_lost,
        _unavailable(FlightMode.OFFBOARD),
    ),
    _refuse(_FLYING, FlightMode.MISSION, when.no_mission, "Mission rejected: no valid mission"),
    CommanderRow(
        _FLYING - _DOWNWARD,
        FlightMode.LAND,
        when.position_lost,
        CommanderState.FAILSAFE_DESCEND,
        FlightMode.LAND,
    ),
    *_SETS,
)

TABLE: tuple[CommanderRow, ...] = _FAILSAFES + _PROGRESS + _ARMING + _MODES
"""All rows, in order."""

RULES: dict[tuple[CommanderState, Trigger], tuple[CommanderRow, ...]] = {
    (state, event): tuple(row for row in TABLE if state in row.states and row.event is event)
    for state in CommanderState
    for event in (*Event, *FlightMode, *FailsafeCause)
}
"""The same, by state and event."""

TICK_RULES: dict[CommanderState, tuple[tuple[Guard, CommanderRow], ...]] = {
    state: tuple((row.guard, row) for row in RULES[state, Event.TICK] if row.guard is not None)
    for state in CommanderState
}
"""The rows of a tick with their guards, which they all have; evaluated in every tick."""


def first_match(rows: tuple[CommanderRow, ...], now: Situation) -> CommanderRow | None:
    """The first row whose guard is true; None: nothing happens in this tick."""
    for row in rows:
        if row.guard is None or row.guard(now):
            return row
    return None
