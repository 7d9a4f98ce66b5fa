"""A mission as data: what its file says, and, after expansion, the chart that is flown."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from offboard.chart.problems import NOWHERE, Place


@dataclass(frozen=True, slots=True)
class Action:
    """One line of `enter`, `exit` or `during`: a primitive by name, or `location = expression`.

    Attributes:
        place: where it begins.
        name: the primitive; empty for an assignment.
        location: what is assigned to, dotted; empty for a primitive.
        expression: its new value.
        expression_place: where that begins.
    """

    place: Place
    name: str = ""
    location: str = ""
    expression: str = ""
    expression_place: Place = NOWHERE

    def __str__(self) -> str:
        return self.name or f"{self.location} = {self.expression}"


@dataclass(frozen=True, slots=True)
class Transition:
    """One way out of a state.

    Attributes:
        place: of its target.
        to: the target as written; after expansion, a full state id.
        when: the guard; empty for "always".
        when_place: where the guard begins; without one, where the transition begins.
    """

    place: Place
    to: str
    when: str = ""
    when_place: Place = NOWHERE


@dataclass(frozen=True, slots=True)
class State:
    """A state or, if it has states of its own, a superstate.

    Attributes:
        place: of its name.
        id: name as written; after expansion the full id ("red.turning").
        initial: the state a superstate starts in.
        initial_place, then_place: of what they name.
        then: where a superstate goes on when one of its final states is reached.
        use: the template whose states it takes; empty after expansion.
        resume: where the mission goes on after a pause within this state; None: where it was.
    """

    place: Place
    id: str
    initial: str = ""
    initial_place: Place = NOWHERE
    final: bool = False
    then: str = ""
    then_place: Place = NOWHERE
    use: str = ""
    resume: Transition | None = None
    enter: tuple[Action, ...] = ()
    during: tuple[Action, ...] = ()
    exit: tuple[Action, ...] = ()
    transitions: tuple[Transition, ...] = ()
    states: tuple[State, ...] = ()

    @property
    def name(self) -> str:
        """Last part of the id."""
        return self.id.rpartition(".")[2]


@dataclass(frozen=True, slots=True)
class MissionFile:
    """A mission file as written."""

    place: Place
    path: Path
    name: str = ""
    description: str = ""
    extends: str = ""
    initial: str = ""
    initial_place: Place = NOWHERE
    variables: dict[str, object] = field(default_factory=dict)
    templates: dict[str, State] = field(default_factory=dict)
    states: tuple[State, ...] = ()


@dataclass(frozen=True, slots=True)
class Leaf:
    """A state without states of its own, with everything that holds while it is active.

    Attributes:
        transitions: its own first, then those of the superstates around it, in order of priority.
        during: its own first, then those of the superstates around it.
        resume: its own or, without one, that of the nearest superstate that has one.
    """

    state: State
    transitions: tuple[Transition, ...]
    during: tuple[Action, ...]
    resume: Transition | None


def leaves(states: tuple[State, ...], outer: tuple[State, ...] = ()) -> list[Leaf]:
    """All states without states of their own, in document order.

    Args:
        states: a level of an expanded chart.
        outer: the superstates around it, innermost first.
    """
    found: list[Leaf] = []
    for state in states:
        if state.states:
            found += leaves(state.states, (state, *outer))
            continue
        around = (state, *outer)
        transitions = () if state.final else tuple(t for s in around for t in s.transitions)
        during = () if state.final else tuple(a for s in around for a in s.during)
        resume = None if state.final else next((s.resume for s in around if s.resume), None)
        found.append(Leaf(state, transitions, during, resume))
    return found


def all_states(states: tuple[State, ...]) -> list[State]:
    """All states of a chart, superstates before their own, in document order."""
    return [found for state in states for found in (state, *all_states(state.states))]
