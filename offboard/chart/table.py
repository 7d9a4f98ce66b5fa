"""The expanded chart as the engine runs it: what each state tests and does, and what a transition does.

One state without states of its own is active, with the superstates around it, and a chart has no history. So
what a transition does depends on the active state only: the actions of leaving, from within outwards, its own
and those of entering, from outside inwards, and the same for each `then` that follows. A superstate around
both source and target is neither left nor entered.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from offboard.chart.expressions import Evaluate, compile_value
from offboard.chart.spec import (
    Action,
    MissionFile,
    Transition,
    all_states,
    entry_of,
    is_finish,
    leaves,
    state_path,
)
from offboard.pilot import Pilot

Act = Callable[[Pilot], None]


@dataclass(frozen=True, slots=True)
class Guarded:
    """A transition out of an active state with its compiled guard."""

    transition: Transition
    holds: Evaluate


@dataclass(frozen=True, slots=True)
class ChartRow:
    """What a state without states of its own does while it is active.

    Attributes:
        transitions: out of it, in order of priority.
        during: done at each tick in which none is taken.
        resume: taken after a pause; None: the mission goes on in the state.
        finish: the mission is over.
    """

    transitions: tuple[Guarded, ...]
    during: tuple[Act, ...]
    resume: Transition | None
    finish: bool


@dataclass(frozen=True, slots=True)
class ChartPassage:
    """All that happens when a transition is taken.

    Attributes:
        actions: in order.
        leaf: full id of the state that is active afterwards.
        ids: of the transition, and of each `then` that it leads to.
    """

    actions: tuple[Act, ...]
    leaf: str
    ids: tuple[str, ...]


class ChartTable:
    """A chart that can be run.

    Args:
        chart: expanded and checked.

    Attributes:
        start: leads into the chart, from no state.
        rows: by full ids of the states without states of their own, in document order.
    """

    def __init__(self, chart: MissionFile) -> None:
        self._states = {state.id: state for state in all_states(chart.states)}
        self.start = Transition(chart.initial_place, chart.initial)
        self.rows: Mapping[str, ChartRow] = {
            leaf.state.id: ChartRow(
                tuple(Guarded(each, compile_value(each.when or "True")) for each in leaf.transitions),
                tuple(map(_act, leaf.during)),
                leaf.resume,
                is_finish(self._states, leaf.state.id),
            )
            for leaf in leaves(chart.states)
        }

    def passage(self, source: str, transition: Transition) -> ChartPassage:
        """What happens when a transition is taken while a state is active; "" is none."""
        states = self._states
        actions: list[Action] = []
        active, target, between = state_path(source), transition.to, transition.actions
        ids = [transition.id]
        while True:
            around = set(state_path(source)[:-1]).intersection(state_path(target)[:-1])
            leaf = entry_of(states, target)
            actions += [each for name in reversed(active) if name not in around for each in states[name].exit]
            actions += between
            active = state_path(leaf)
            actions += [each for name in active if name not in around for each in states[name].enter]
            outer = states.get(leaf.rpartition(".")[0])
            if not states[leaf].final or outer is None or not outer.then or len(ids) > len(states):
                return ChartPassage(tuple(map(_act, actions)), leaf, tuple(ids))
            ids.append(outer.then.id)
            source, target, between = outer.id, outer.then.to, ()


def _act(action: Action) -> Act:
    if action.name:
        name = action.name

        def call(pilot: Pilot) -> None:
            getattr(pilot, name)()

        return call
    *owners, attribute = action.location.split(".")
    value = compile_value(action.expression)

    def assign(pilot: Pilot) -> None:
        owner: object = pilot
        for part in owners:
            owner = getattr(owner, part)
        setattr(owner, attribute, value(pilot))

    return assign
