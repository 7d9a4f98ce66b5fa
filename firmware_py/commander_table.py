"""The commander's state machine as a table: what each event does in each state.

Rows are tried from the top and the first that fits counts, so failsafes stand first. Nothing here keeps
state or acts; `firmware_py.commander` does. Texts and results are PX4's wherever PX4 has the same case.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from firmware_py import commander_guards as when
from firmware_py.commander_guards import Guard, Situation
from firmware_py.status import CommandResult, FlightMode

CRITICAL, WARNING, INFO = 2, 4, 6  # MAV_SEVERITY


class State(Enum):
    """Armed or not, the mode flown, and whether a failsafe chose it."""

    DISARMED = "disarmed"
    HOLD = "hold"
    TAKEOFF = "takeoff"
    LAND = "land"
    OFFBOARD = "offboard"
    LOSS_HOLD = "loss_hold"  # offboard setpoints lost: hold
    LOSS_LAND = "loss_land"  # still lost: land


class Event(Enum):
    """What may happen. Conditions of the vehicle are guards on TICK."""

    TICK = "tick"
    ARM = "arm"
    DISARM = "disarm"
    FORCE_DISARM = "force_disarm"
    SET_HOLD = "set_hold"
    SET_TAKEOFF = "set_takeoff"
    SET_LAND = "set_land"
    SET_OFFBOARD = "set_offboard"


FLOWN_MODE: dict[State, FlightMode] = {
    State.HOLD: FlightMode.HOLD,
    State.TAKEOFF: FlightMode.TAKEOFF,
    State.LAND: FlightMode.LAND,
    State.OFFBOARD: FlightMode.OFFBOARD,
    State.LOSS_HOLD: FlightMode.HOLD,
    State.LOSS_LAND: FlightMode.LAND,
}
"""The flight mode of each armed state."""

MODE_EVENT: dict[FlightMode, Event] = {
    FlightMode.HOLD: Event.SET_HOLD,
    FlightMode.TAKEOFF: Event.SET_TAKEOFF,
    FlightMode.LAND: Event.SET_LAND,
    FlightMode.OFFBOARD: Event.SET_OFFBOARD,
}
"""The event that asks for each mode."""


@dataclass(frozen=True, slots=True)
class Row:
    """One rule. Entering DISARMED stops the motors; leaving it sets home.

    Attributes:
        states: where it holds.
        event: what happens.
        guard: what must be true as well; None: always.
        target: the next state; None: stay, and the mode flown goes on undisturbed.
        intends: what becomes the mode asked for; None: as before.
        result: the answer to a command.
        severity: MAV_SEVERITY of the text.
        text: what people are told; empty: nothing.
    """

    states: frozenset[State]
    event: Event
    guard: Guard | None = None
    target: State | None = None
    intends: FlightMode | None = None
    result: CommandResult = CommandResult.ACCEPTED
    severity: int = INFO
    text: str = ""


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


def _refuse(states: frozenset[State], event: Event, guard: Guard | None, text: str) -> Row:
    return Row(states, event, guard, result=CommandResult.TEMPORARILY_REJECTED, severity=CRITICAL, text=text)


_OFF = _at(State.DISARMED)
_ARMED = frozenset(FLOWN_MODE)
_LOSS = _at(State.LOSS_HOLD, State.LOSS_LAND)

FAILSAFE_STATES = _LOSS

_FAILSAFES = (
    _stop(_ARMED, when.sensors_lost, "Sensors lost: motors stopped", severity=CRITICAL),
    _stop(_ARMED, when.tumbled, "Attitude failure: motors stopped", severity=CRITICAL),
    _stop(_ARMED, when.landed_after_flight, "Disarmed by landing"),
    _stop(_at(State.LAND, State.LOSS_LAND), when.landing_done, "Disarmed by landing"),
    _stop(_ARMED, when.never_flown, "Disarmed by auto preflight disarming"),
    _tick(_LOSS, when.setpoint_fresh, State.OFFBOARD, "Offboard setpoints are back: offboard resumed"),
    _tick(
        _at(State.OFFBOARD),
        when.setpoint_lost_land,
        State.LOSS_LAND,
        "Failsafe activated: offboard setpoints lost, landing",
        severity=CRITICAL,
    ),
    _tick(
        _at(State.OFFBOARD),
        when.setpoint_lost,
        State.LOSS_HOLD,
        "Failsafe activated: offboard setpoints lost, hold",
        severity=CRITICAL,
    ),
    _stop(_at(State.LOSS_HOLD), when.hold_over_on_ground, "Disarmed by failsafe", severity=CRITICAL),
    _tick(_at(State.LOSS_HOLD), when.hold_over, State.LOSS_LAND, "Failsafe: landing", severity=CRITICAL),
)

_PROGRESS = (_tick(_at(State.TAKEOFF), when.target_reached, State.HOLD, intends=FlightMode.HOLD),)

_ARMING = (
    _refuse(_OFF, Event.ARM, when.unhealthy, "Arming denied: Resolve system health failures first"),
    _refuse(_OFF, Event.ARM, when.intends_land, "Arming denied: not in Land mode"),
    _refuse(_OFF, Event.ARM, when.intends_offboard_unfed, "Arming denied: no offboard setpoints"),
    Row(_OFF, Event.ARM, when.intends_offboard, State.OFFBOARD, text="Armed by external command"),
    Row(_OFF, Event.ARM, when.intends_takeoff, State.TAKEOFF, text="Armed by external command"),
    Row(_OFF, Event.ARM, None, State.HOLD, text="Armed by external command"),
    Row(_ARMED, Event.ARM),
    Row(_OFF, Event.DISARM),
    Row(
        _ARMED,
        Event.DISARM,
        when.landed,
        State.DISARMED,
        FlightMode.HOLD,
        text="Disarmed by external command",
    ),
    _refuse(_ARMED, Event.DISARM, None, "Disarming denied: not landed"),
    Row(_OFF, Event.FORCE_DISARM),
    Row(
        _ARMED,
        Event.FORCE_DISARM,
        None,
        State.DISARMED,
        FlightMode.HOLD,
        text="Disarmed by external command",
    ),
)

_MODES = (
    Row(_OFF, Event.SET_HOLD, intends=FlightMode.HOLD),
    Row(_OFF, Event.SET_TAKEOFF, intends=FlightMode.TAKEOFF),
    Row(_OFF, Event.SET_LAND, intends=FlightMode.LAND),
    Row(_OFF, Event.SET_OFFBOARD, intends=FlightMode.OFFBOARD),
    Row(_at(State.HOLD), Event.SET_HOLD),
    Row(_ARMED, Event.SET_HOLD, None, State.HOLD, FlightMode.HOLD),
    Row(_ARMED, Event.SET_TAKEOFF, None, State.TAKEOFF, FlightMode.TAKEOFF),
    Row(_at(State.LAND), Event.SET_LAND),
    Row(_ARMED, Event.SET_LAND, None, State.LAND, FlightMode.LAND),
    Row(_at(State.OFFBOARD), Event.SET_OFFBOARD),
    _refuse(
        _ARMED,
        Event.SET_OFFBOARD,
        when.setpoint_lost,
        "Switching to Offboard is currently not available",
    ),
    Row(_ARMED, Event.SET_OFFBOARD, None, State.OFFBOARD, FlightMode.OFFBOARD),
)

TABLE: tuple[Row, ...] = _FAILSAFES + _PROGRESS + _ARMING + _MODES
"""All rules, in order."""

RULES: dict[tuple[State, Event], tuple[Row, ...]] = {
    (state, event): tuple(row for row in TABLE if state in row.states and row.event is event)
    for state in State
    for event in Event
}
"""The same, by state and event: a tick tries only the rows that can hold."""


def first_match(rows: tuple[Row, ...], now: Situation) -> Row | None:
    """The first row whose guard is true; None if there is none (a tick on which nothing happens)."""
    for row in rows:
        if row.guard is None or row.guard(now):
            return row
    return None


def mermaid() -> str:
    """The table as a Mermaid state diagram; refusals and what changes nothing are left out."""
    lines = ["stateDiagram-v2", '    state "any armed state" as armed', "    [*] --> disarmed"]
    for row in TABLE:
        if row.target is None:
            continue
        name = "" if row.event is Event.TICK else row.event.value
        guard = f"[{row.guard.__name__.replace('_', ' ')}]" if row.guard is not None else ""
        sources = ["armed"] if row.states == _ARMED else sorted(state.value for state in row.states)
        lines += [f"    {source} --> {row.target.value}: {f'{name} {guard}'.strip()}" for source in sources]
    return "\n".join(lines) + "\n"
