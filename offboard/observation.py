"""What a mission does now, as plain data: the active states and what their guards read. Made only on request.

Reading changes nothing that flies. A contestant's properties are read as a guard reads them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from framerunner.errors import UserError
from framerunner.wire.mission_report import GuardNow, Plain, ValueNow, plain_value, rounded
from offboard.chart.described import unit_of
from offboard.chart.expressions import Evaluate, names_in
from offboard.chart.spec import State
from offboard.chart.table import Guarded
from offboard.pilot_file import is_interrupt

if TYPE_CHECKING:
    from offboard.mission import Mission
    from offboard.pilot import Pilot


class ChangeRefusedError(UserError):
    """A changed chart cannot take over; the message is one line that says why."""


@dataclass(frozen=True, slots=True)
class ChartNow:
    """The chart after a tick.

    Attributes:
        state: full id of the active leaf; "" before the first tick.
        active: full ids of all active states, outermost first.
        seconds_in_state: vehicle time without pauses.
        guards: of the transitions out of the active states, in order of priority.
        values: all that these guards read, each once; one that cannot be read is left out.
    """

    state: str
    active: tuple[str, ...]
    seconds_in_state: float
    guards: tuple[GuardNow, ...] = ()
    values: tuple[ValueNow, ...] = ()


def guards_now(transitions: Sequence[Guarded], pilot: Pilot) -> tuple[GuardNow, ...]:
    """The present truth of the guards of an active state."""
    return tuple(
        GuardNow(each.transition.id, each.transition.to, each.transition.when, _truth(each.holds, pilot))
        for each in transitions
    )


def values_now(transitions: Sequence[Guarded], pilot: Pilot) -> tuple[ValueNow, ...]:
    """The present values of all names in the guards of an active state."""
    names = dict.fromkeys(name for each in transitions for name in names_in(each.transition.when))
    return tuple(
        ValueNow(name, rounded(value), unit_of(type(pilot), name))
        for name, value in read_values(names, pilot)
    )


def read_values(names: Sequence[str] | dict[str, None], pilot: Pilot) -> tuple[tuple[str, Plain], ...]:
    """The present values of dotted names; one that cannot be read is left out."""
    found = []
    for name in names:
        value: object = pilot
        try:
            for part in name.split("."):
                value = getattr(value, part)
            found.append((name, plain_value(value)))
        except BaseException as error:  # of a value that the guard itself did not read
            if is_interrupt(error):
                raise
    return tuple(found)


def check_change(old: Mission, new: Mission, state: str) -> None:
    """Raise `ChangeRefusedError` unless a flight that is in a state of `old` can go on with `new`."""
    for what, before, after in (
        ("class", old.mission_class, new.mission_class),
        ("vision", old.vision, new.vision),
        ("detector", old.detector, new.detector),
    ):
        if before != after:
            raise ChangeRefusedError(
                f"{what}: {after} cannot replace {before} during a flight; stop it and start it again"
            )
    if new.pilot != old.pilot:
        raise ChangeRefusedError("the changed chart is for another pilot; stop the flight and start it again")
    if not state:
        return
    reason = ""
    if state not in new.states:
        reason = "is not in the changed chart"
    elif state not in new.leaves:
        reason = "has states of its own in the changed chart"
    elif new.states[state].final and not old.states[state].final:
        reason = "is final in the changed chart"
    if reason:
        raise ChangeRefusedError(
            f"the active state '{state}' {reason}; leave it as it is, or go on until another state is active"
        )


def carried_ids(old: Mission, new: Mission) -> dict[str, str]:
    """Which transitions of a chart are which of a changed one, by id.

    A transition is the same as that of its state with the same target and guard, otherwise as the nearest
    other one with the same target; so counts stay with their transitions when others are added or moved.
    """
    found: dict[str, str] = {}
    for name, state in old.states.items():
        if (after := new.states.get(name)) is not None:
            found |= _carried(state, after)
    return found


def _carried(old: State, new: State) -> dict[str, str]:
    found: dict[str, str] = {}
    free = list(new.transitions)
    for each in old.transitions:
        same = next((one for one in free if (one.to, one.when) == (each.to, each.when)), None)
        if same is not None:
            found[each.id] = same.id
            free.remove(same)
    for number, each in enumerate(old.transitions):
        near = [(abs(at - number), at) for at, one in enumerate(new.transitions) if one in free]
        near = [(away, at) for away, at in near if new.transitions[at].to == each.to]
        if near and each.id not in found:
            match = new.transitions[min(near)[1]]
            found[each.id] = match.id
            free.remove(match)
    for one, other in ((old.then, new.then), (old.resume, new.resume)):
        if one is not None and other is not None:
            found[one.id] = other.id
    return found


def _truth(guard: Evaluate, pilot: Pilot) -> bool | None:
    try:
        return bool(guard(pilot))
    except BaseException as error:  # such as of a contestant's property
        if is_interrupt(error):
            raise
        return None
