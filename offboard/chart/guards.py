"""Checks the guards of a chart without errors: which never hold or are hidden, and where a time-out lacks."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

from framerunner.files.yaml_text import Place
from offboard.chart.conditions import Conditions
from offboard.chart.expressions import names_in
from offboard.chart.mission_texts import Message
from offboard.chart.problems import ProblemList, cut
from offboard.chart.spec import Action, Leaf, MissionFile, State, Transition, all_states, leaves
from offboard.chart.vocabulary import Vocabulary

MAX_COMPARED = 40
"""Transitions of one state that are compared with each other."""
_CLOCKS = ("seconds_in_state", "seconds_in_mission")
_LONG_S = 1e9


def check_guards(
    mission: MissionFile, vocabulary: Vocabulary, problems: ProblemList, *, own_pilot: bool
) -> None:
    """Warn of transitions that are never taken, and advise time-outs.

    Args:
        mission: expanded, without errors.
        vocabulary: its names.
        problems: takes what is found.
        own_pilot: the pilot is a contestant's, whose primitives may set variables.
    """
    known = {} if own_pilot else _constants(mission)
    constants = {f"memory.{name}": value for name, value in known.items()}
    conditions = Conditions(vocabulary, constants)
    at_last = Conditions(vocabulary, constants | dict.fromkeys(_CLOCKS, _LONG_S))
    for state in all_states(mission.states):
        for transition in state.transitions:
            _check_guard(transition, conditions, problems)
    chart = leaves(mission.states)
    _check_hidden(chart, conditions, problems)
    _check_timeouts(chart, at_last, problems)


def actions_of(state: State) -> Iterator[Action]:
    """All actions of a state, also of its transitions."""
    yield from (*state.enter, *state.during, *state.exit)
    for transition in state.transitions:
        yield from transition.actions


def _constants(mission: MissionFile) -> dict[str, object]:
    """The variables that nothing assigns to."""
    assigned = {action.location for state in all_states(mission.states) for action in actions_of(state)}
    return {name: value for name, value in mission.variables.items() if f"memory.{name}" not in assigned}


def _check_guard(transition: Transition, conditions: Conditions, problems: ProblemList) -> None:
    when = transition.when
    if not when:
        return
    reason = conditions.why_never(when)
    if reason is not None:
        message = Message("guard.never", when=cut(when), reason=reason)
        problems.add(transition.when_place, message, "warning")
    elif when not in ("True", "1 == 1") and conditions.holds_always(when):
        message = Message("guard.always", when=cut(when), reason=Message("guard.always_true"))
        problems.add(transition.when_place, message, "warning")


def _check_hidden(chart: list[Leaf], conditions: Conditions, problems: ProblemList) -> None:
    """A transition is hidden if it is in all states that have it: a superstate's is in several."""
    seen: set[Place] = set()
    hidden: dict[Place, Message | None] = {}
    why_hidden = cache(lambda earlier, when: _hidden_by(earlier, when, conditions))
    for leaf in chart:
        elders: list[tuple[str, Place]] = []
        for transition in leaf.transitions[:MAX_COMPARED]:
            place = transition.when_place
            if conditions.why_never(transition.when or "True") is None:
                found = why_hidden(tuple(when for when, _ in elders), transition.when)
                message = None if found is None else _hidden_message(leaf, elders, found)
                if message is None or place not in seen:
                    hidden[place] = message
                seen.add(place)
            elders.append((transition.when, place))
    for place, message in hidden.items():
        if message is not None:
            problems.add(place, message, "warning")


def _hidden_by(elders: tuple[str, ...], when: str, conditions: Conditions) -> int | None:
    """Number of the elder that hides a guard, -1 if only several together do; None if it is not hidden."""
    for number, elder in enumerate(elders):
        if conditions.hides((elder,), when):
            return number
    return -1 if len(elders) > 1 and conditions.hides(elders, when) else None


def _hidden_message(leaf: Leaf, elders: list[tuple[str, Place]], found: int) -> Message:
    if found < 0:
        return Message("transition.hidden_by_several", state=leaf.state.id)
    return Message("transition.hidden", state=leaf.state.id, line=elders[found][1].line)


def _check_timeouts(chart: list[Leaf], at_last: Conditions, problems: ProblemList) -> None:
    """A state that reads the world in its guards is left in the end whatever the world does."""
    surely_left = cache(lambda guards: at_last.hides(guards, ""))
    for leaf in chart:
        guards = tuple(transition.when for transition in leaf.transitions[:MAX_COMPARED])
        if leaf.state.final or not guards or surely_left(guards):
            continue
        names = {name for when in guards for name in names_in(when)}
        if any(name not in _CLOCKS and not name.startswith("memory.") for name in names):
            problems.add(leaf.state.place, Message("state.no_timeout", state=leaf.state.id), "advice")
