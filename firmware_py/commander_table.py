"""The commander's state machine as a table: what each event does in each state.

Rows are tried from the top and the first match counts, so failsafes come first. Nothing here keeps state
or acts; `firmware_py.commander` does. Texts and results are PX4's wherever PX4 has the same case.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from firmware_py import commander_guards as when
from firmware_py.commander_guards import MANUAL_MODES, Cause, Guard, Reaction, Situation
from firmware_py.status import CommandResult, FlightMode
from firmware_py.types import CRITICAL, INFO, WARNING


class State(Enum):
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
    PILOT_TAKES_OVER = "pilot_takes_over"
    MISSION_DONE = "mission_done"
    MISSION_RETURNS = "mission_returns"


Trigger = Event | FlightMode | Cause
"""What a row applies to: an event, the request of a mode, or the cause of a failsafe."""

FLOWN_MODE: dict[State, FlightMode] = {
    **{state: FlightMode[state.name] for state in State if state.name in FlightMode.__members__},
    State.FAILSAFE_HOLD: FlightMode.HOLD,
    State.FAILSAFE_RETURN: FlightMode.RETURN,
    State.FAILSAFE_LAND: FlightMode.LAND,
    State.FAILSAFE_DESCEND: FlightMode.LAND,
    State.TERMINATED: FlightMode.TERMINATION,
}
"""The flight mode of each armed state."""


@dataclass(frozen=True, slots=True)
class Row:
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

    states: frozenset[State]
    event: Trigger
    guard: Guard | None = None
    target: State | None = None
    intends: FlightMode | None = None
    result: CommandResult = CommandResult.ACCEPTED
    severity: int = INFO
    text: str = ""
    follow_up: Reaction = Reaction.NOTHING

    @property
    def cause(self) -> Cause | None:
        """Of a failsafe; None: the target is entered for another reason."""
        return self.event if isinstance(self.event, Cause) else None


def _at(*states: State) -> frozenset[State]:
    return frozenset(states)


def _tick(
    states: frozenset[State],
    guard: Guard,
    target: State,
    text: str = "",
    *,
    severity: int = INFO,
    intends: FlightMode | None = None,
) -> Row:
    return Row(states, Event.TICK, guard, target, intends, severity=severity, text=text)


def _stop(states: frozenset[State], guard: Guard, text: str, *, severity: int = INFO) -> Row:
    return _tick(states, guard, State.DISARMED, text, severity=severity, intends=FlightMode.HOLD)


def _fail(
    states: frozenset[State],
    event: Trigger,
    guard: Guard | None,
    target: State,
    text: str,
    *,
    follow_up: Reaction = Reaction.NOTHING,
) -> Row:
    return Row(states, event, guard, target, severity=CRITICAL, text=text, follow_up=follow_up)


def _refuse(states: frozenset[State], event: Trigger, guard: Guard | None, text: str) -> Row:
    return Row(states, event, guard, result=CommandResult.TEMPORARILY_REJECTED, severity=CRITICAL, text=text)


_OFF = _at(State.DISARMED)
_ARMED = frozenset(FLOWN_MODE)
_FLYING = _ARMED - _at(State.TERMINATED)
_DOWNWARD = _at(State.LAND, State.FAILSAFE_LAND, State.FAILSAFE_DESCEND)
_HOMEWARD = _at(State.RETURN, State.FAILSAFE_RETURN)
_LANDING = _DOWNWARD | _HOMEWARD
BY_HAND = _at(State.MANUAL, State.STABILIZED, State.ACRO, State.ALTITUDE, State.POSITION)
"""States flown by the sticks."""
_BLIND = _at(State.MANUAL, State.STABILIZED, State.ACRO, State.ALTITUDE)  # no position needed

_HARD_FAILURES = (
    _stop(_FLYING, when.sensors_lost_on_ground, "Sensors lost: motors stopped", severity=CRITICAL),
    _tick(_FLYING, when.sensors_lost, State.TERMINATED, "Sensors lost: flight terminated", severity=CRITICAL),
    _tick(_FLYING, when.tumbled, State.TERMINATED, "Attitude failure: flight terminated", severity=CRITICAL),
    _stop(_ARMED, when.landed_after_flight, "Disarmed by landing"),
    _stop(_LANDING, when.landing_done, "Disarmed by landing"),
    _stop(_FLYING, when.never_flown, "Disarmed by auto preflight disarming"),
    _tick(_FLYING, when.offboard_back, State.OFFBOARD, "Offboard setpoints are back: offboard resumed"),
    _stop(_at(State.FAILSAFE_HOLD), when.hold_over_on_ground, "Disarmed by failsafe", severity=CRITICAL),
)

_STEPS = {
    Reaction.HOLD: (State.FAILSAFE_HOLD, _FLYING - _LANDING - _at(State.FAILSAFE_HOLD)),
    Reaction.RETURN: (State.FAILSAFE_RETURN, _FLYING - _LANDING),
    Reaction.LAND: (State.FAILSAFE_LAND, _FLYING - _DOWNWARD),
    Reaction.TERMINATE: (State.TERMINATED, _FLYING),
    Reaction.DISARM: (State.DISARMED, _FLYING),
}
"""The target of each reaction, and the states from which it is entered: none that are more severe."""

_STICKS = {
    Reaction.STABILIZED: State.STABILIZED,
    Reaction.ALTITUDE: State.ALTITUDE,
    Reaction.POSITION: State.POSITION,
}

_DOING = {Reaction.RETURN: "returning home", Reaction.LAND: "landing"}
_DELAYED = (Cause.GROUND_STATION, Cause.MANUAL)
"""Causes that may end: PX4 holds for COM_FAIL_ACT_T before it acts."""


def _hold_ends(reaction: Reaction) -> Row:
    target, _ = _STEPS[reaction]
    guard = when.hold_over_then(reaction)
    return _fail(_at(State.FAILSAFE_HOLD), Event.TICK, guard, target, f"Failsafe: {_DOING[reaction]}")


def _reactions(cause: Cause, *, from_sticks: bool = False) -> tuple[Row, ...]:
    """The rows of one cause: each reaction, in the states in which it is more severe."""
    rows = []
    alarm = f"Failsafe activated: {cause.value}"
    if from_sticks:
        for reaction, target in _STICKS.items():
            guard = when.reacts_with_sticks(cause, reaction)
            rows.append(_fail(_FLYING - _LANDING, cause, guard, target, f"{alarm}, {reaction.value}"))
    for reaction, (target, states) in _STEPS.items():
        delayed = cause in _DELAYED and reaction in {Reaction.RETURN, Reaction.LAND}
        if cause is Cause.SETPOINTS and reaction is Reaction.HOLD:
            follow_up = Reaction.LAND  # the app is gone; see docs/px4-compatibility.md
        else:
            follow_up = reaction if delayed else Reaction.NOTHING
        rows.append(
            _fail(
                states - _HOMEWARD - _at(State.FAILSAFE_HOLD) if delayed else states,
                cause,
                when.reacts(cause, reaction),
                State.FAILSAFE_HOLD if delayed else target,
                f"{alarm}, {'hold, then ' if delayed else ''}{reaction.value}",
                follow_up=follow_up,
            )
        )
    warns = when.reacts(cause, Reaction.WARN)
    rows.append(Row(_FLYING, cause, warns, severity=WARNING, text=f"Warning: {cause.value}"))
    rows.append(Row(frozenset(State), cause))
    return tuple(rows)


_MANUAL_NOT_THERE = _fail(
    BY_HAND,
    Cause.MANUAL,
    when.reacts(Cause.MANUAL, Reaction.NOTHING),
    State.FAILSAFE_HOLD,
    f"Failsafe activated: {Cause.MANUAL.value}, hold",
)

_POSITION_LOST = (
    _fail(
        _at(State.POSITION),
        Cause.POSITION,
        when.manual_present,
        State.ALTITUDE,
        "Position lost: altitude mode",
    ),
    _fail(
        _FLYING - _BLIND - _at(State.FAILSAFE_DESCEND),
        Cause.POSITION,
        None,
        State.FAILSAFE_DESCEND,
        "Failsafe activated: position lost, descending",
    ),
    Row(frozenset(State), Cause.POSITION),
)

_FAILSAFES = (
    _HARD_FAILURES
    + tuple(_hold_ends(reaction) for reaction in (Reaction.RETURN, Reaction.LAND))
    + _POSITION_LOST
    + _reactions(Cause.SETPOINTS, from_sticks=True)
    + (_MANUAL_NOT_THERE,)
    + tuple(
        row for cause in Cause if cause not in {Cause.SETPOINTS, Cause.POSITION} for row in _reactions(cause)
    )
)

_PROGRESS = (
    _tick(_at(State.TAKEOFF), when.target_reached_with_mission, State.MISSION, intends=FlightMode.MISSION),
    _tick(_at(State.TAKEOFF), when.target_reached, State.HOLD, intends=FlightMode.HOLD),
    Row(_at(State.MISSION), Event.MISSION_DONE, None, State.HOLD, FlightMode.HOLD),
    Row(frozenset(State), Event.MISSION_DONE),
    Row(_at(State.MISSION), Event.MISSION_RETURNS, None, State.RETURN, FlightMode.RETURN),
    Row(frozenset(State), Event.MISSION_RETURNS),
    Row(
        _FLYING - BY_HAND,
        Event.PILOT_TAKES_OVER,
        None,
        State.POSITION,
        FlightMode.POSITION,
        text="Pilot took over using sticks",
    ),
    Row(frozenset(State), Event.PILOT_TAKES_OVER),
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
        Row(_OFF, Event.ARM, when.intends(mode), state, text=_ARMED_TEXT)
        for state, mode in FLOWN_MODE.items()
        if mode not in when.UNARMABLE and state not in {State.HOLD, State.FAILSAFE_HOLD}
    ),
    Row(_OFF, Event.ARM, None, State.HOLD, text=_ARMED_TEXT),
    Row(_ARMED, Event.ARM),
    Row(_OFF, Event.DISARM),
    Row(_ARMED, Event.DISARM, when.landed, State.DISARMED, FlightMode.HOLD, text=_DISARMED_TEXT),
    Row(_at(State.TERMINATED), Event.DISARM, None, State.DISARMED, FlightMode.HOLD, text=_DISARMED_TEXT),
    _refuse(_ARMED, Event.DISARM, None, "Disarming denied: not landed"),
    Row(_OFF, Event.FORCE_DISARM),
    Row(_ARMED, Event.FORCE_DISARM, None, State.DISARMED, FlightMode.HOLD, text=_DISARMED_TEXT),
    Row(_OFF, FlightMode.TERMINATION),
    Row(_at(State.TERMINATED), FlightMode.TERMINATION),
    Row(_FLYING, FlightMode.TERMINATION, None, State.TERMINATED, severity=CRITICAL, text="Flight terminated"),
)


def _unavailable(mode: FlightMode) -> str:
    return f"Switching to {mode.name.capitalize()} is currently not available"


_AFTER_TERMINATION = tuple(
    _refuse(_at(State.TERMINATED), mode, None, "Mode change refused: flight terminated")
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
    State.HOLD,
    State.LAND,
    State.RETURN,
    State.MISSION,
    State.OFFBOARD,
    *sorted(BY_HAND, key=lambda s: s.value),
)
_SETS = tuple(
    row
    for state, mode in FLOWN_MODE.items()
    if state.name == mode.name
    for row in (
        Row(_OFF, mode, intends=mode),
        *((Row(_at(state), mode, intends=mode),) if state in _STAYS else ()),
        Row(_FLYING, mode, None, state, mode),
    )
)

_MODES = (
    *_AFTER_TERMINATION,
    *_NEEDS_STICKS,
    *_NEEDS_POSITION,
    _refuse(
        _FLYING - _at(State.OFFBOARD),
        FlightMode.OFFBOARD,
        when.setpoint_lost,
        _unavailable(FlightMode.OFFBOARD),
    ),
    _refuse(_FLYING, FlightMode.MISSION, when.no_mission, "Mission rejected: no valid mission"),
    Row(_FLYING - _DOWNWARD, FlightMode.LAND, when.position_lost, State.FAILSAFE_DESCEND, FlightMode.LAND),
    *_SETS,
)

TABLE: tuple[Row, ...] = _FAILSAFES + _PROGRESS + _ARMING + _MODES
"""All rows, in order."""

RULES: dict[tuple[State, Trigger], tuple[Row, ...]] = {
    (state, event): tuple(row for row in TABLE if state in row.states and row.event is event)
    for state in State
    for event in (*Event, *FlightMode, *Cause)
}
"""The same, by state and event."""

TICK_RULES: dict[State, tuple[tuple[Guard, Row], ...]] = {
    state: tuple((row.guard, row) for row in RULES[state, Event.TICK] if row.guard is not None)
    for state in State
}
"""The rows of a tick with their guards, which they all have; evaluated in every tick."""


def first_match(rows: tuple[Row, ...], now: Situation) -> Row | None:
    """The first row whose guard is true; None: nothing happens in this tick."""
    for row in rows:
        if row.guard is None or row.guard(now):
            return row
    return None
