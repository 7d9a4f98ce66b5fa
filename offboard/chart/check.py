"""Checks an expanded chart: names, expressions, initial states, and that each state is reached and left."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

from framerunner.files.extensions import extension_names
from framerunner.files.yaml_text import Place
from offboard.chart.expressions import (
    IN_LOCATION,
    ExpressionError,
    check_assignment,
    check_guard,
    names_in,
)
from offboard.chart.guards import actions_of, check_guards
from offboard.chart.mission_texts import Message
from offboard.chart.problems import ProblemList, cut, did_you_mean
from offboard.chart.spec import (
    Action,
    Leaf,
    MissionFile,
    State,
    Transition,
    all_states,
    entry_of,
    is_finish,
    leaves,
)
from offboard.chart.vocabulary import UnknownNameError, Vocabulary
from offboard.pilot import NAMES_ON_MAP, Pilot
from vision.types import LEARNED, Vision


def check(mission: MissionFile, pilot_class: type[Pilot], problems: ProblemList) -> None:
    """Check an expanded mission, and its names against a pilot class; `problems` takes what is found."""
    vocabulary = Vocabulary(pilot_class, mission.variables, contest=mission.mission_class != "open")
    if not mission.states:
        problems.add(mission.place, Message("mission.no_states"))
        return
    _check_detector(mission, problems)
    whole = not problems.found
    for state in all_states(mission.states):
        _check_names(state, vocabulary, problems)
    if not whole:
        return  # what follows would report the same faults again
    shape = ProblemList()
    _check_initial(mission.place, Message("what.mission"), mission, shape)
    for state in all_states(mission.states):
        _check_shape(state, shape)
    if not shape.found:
        _check_paths(mission, shape)
    if not problems.found and not shape.found:
        _check_vision(mission, pilot_class, problems)
    if not problems.found and not shape.found:
        check_guards(mission, vocabulary, problems, own_pilot=pilot_class is not Pilot)
    problems.add_all(shape)


def _check_initial(place: Place, what: Message, around: MissionFile | State, problems: ProblemList) -> None:
    names, initial = [state.name for state in around.states], around.initial
    if not initial:
        problems.add(place, Message("initial.missing", what=what, first=names[0]))
    elif initial not in names:
        known = Message("initial.known", names=cut(", ".join(names), 100))
        advice = did_you_mean(initial, names, known)
        message = Message("initial.unknown", what=what, name=cut(initial, 40), advice=advice)
        problems.add(around.initial_place, message)


def _check_shape(state: State, problems: ProblemList) -> None:
    place = state.place
    if state.states:
        _check_initial(place, Message("what.state", state=state.id), state, problems)
        if state.final:
            problems.add(place, Message("state.final_with_states", state=state.id))
        ends = any(child.final for child in state.states)
        if state.then and not ends:
            problems.add(state.states[-1].place, Message("state.then_unreached", state=state.id))
        return
    if state.then or state.initial:
        problems.add(place, Message("state.no_superstate", state=state.id))
    if state.final and state.resume:
        problems.add(state.resume.place, Message("state.final_resume", state=state.id))
    if state.final and (state.transitions or state.during):
        problems.add(place, Message("state.final_more", state=state.id))
    _check_transitions(state, problems)


def _check_transitions(state: State, problems: ProblemList) -> None:
    """No transition is hidden by one above it."""
    seen: dict[str, Transition] = {}
    for transition in state.transitions:
        if "" in seen:
            problems.add(transition.when_place, Message("transition.after_always", state=state.id))
            return
        guard = " ".join(transition.when.split())
        if guard in seen:
            line = seen[guard].when_place.line
            message = Message("transition.same_guard", state=state.id, line=line)
            problems.add(transition.when_place, message)
        seen.setdefault(guard, transition)


def _check_names(state: State, vocabulary: Vocabulary, problems: ProblemList) -> None:
    for transition in state.transitions:
        if transition.when and not problems.full:
            try:
                check_guard(transition.when, vocabulary)
            except ExpressionError as error:
                place = transition.when_place.moved(error.offset)
                problems.add(place, Message("when", when=cut(transition.when), reason=error.message))
    for action in actions_of(state):
        if not problems.full:
            _check_action(action, vocabulary, problems)


def _check_action(action: Action, vocabulary: Vocabulary, problems: ProblemList) -> None:
    try:
        if action.name:
            vocabulary.check_primitive(action.name)
        else:
            check_assignment(action.location, action.expression, vocabulary)
    except UnknownNameError as error:
        problems.add(action.place, error.message)
    except ExpressionError as error:
        in_location = error.offset == IN_LOCATION
        place = action.place if in_location else action.expression_place.moved(error.offset)
        problems.add(place, Message("action", action=cut(str(action)), reason=error.message))


def _check_detector(mission: MissionFile, problems: ProblemList) -> None:
    """A file that anybody may write names an installed detector only; nothing of it runs here."""
    name = mission.detector
    if not name or name == LEARNED:
        return
    known = [each for each in extension_names("detector") if each not in get_args(Vision)]
    if name not in known:
        installed = Message("detector.known", names=", ".join(known)) if known else Message("detector.none")
        advice = did_you_mean(name, known, installed)
        problems.add(mission.detector_place, Message("detector.unknown", name=cut(name, 40), advice=advice))


def _check_vision(mission: MissionFile, pilot_class: type[Pilot], problems: ProblemList) -> None:
    """The map is only used by missions that see gates; the first use is reported."""
    if mission.vision == "frames":
        return
    for state in all_states(mission.states):
        for place, name in _names_used(state):
            if name in NAMES_ON_MAP and getattr(pilot_class, name) is getattr(Pilot, name):
                problems.add(place, Message("vision.needed", name=name, file=mission.path.name))
                return


def _names_used(state: State) -> Iterator[tuple[Place, str]]:
    """Primitives and values of the pilot that a state uses, and where."""
    for action in actions_of(state):
        if action.name:
            yield action.place, action.name
        for name in names_in(action.expression):
            yield action.expression_place, name
    for transition in state.transitions:
        for name in names_in(transition.when):
            yield transition.when_place, name


def _check_paths(mission: MissionFile, problems: ProblemList) -> None:
    """Every state can be entered and left; from each a final one can be reached without a pause."""
    states = {state.id: state for state in all_states(mission.states)}
    by_leaf = {leaf.state.id: leaf for leaf in leaves(mission.states)}
    start = [entry_of(states, mission.initial)]
    successors = _successors(states, by_leaf, pauses=False)
    unpaused = _reached(start, successors)
    back: dict[str, list[str]] = {}
    for leaf_id, targets in successors.items():
        for target in targets:
            back.setdefault(target, []).append(leaf_id)
    ending = _reached([leaf_id for leaf_id in by_leaf if is_finish(states, leaf_id)], back)
    stuck = [leaf_id for leaf_id in by_leaf if leaf_id in unpaused and leaf_id not in ending]
    ends = [leaf_id for leaf_id in stuck if not set(successors[leaf_id]) - {leaf_id}]
    for leaf_id in ends:
        problems.add(states[leaf_id].place, Message("state.no_way_out", state=leaf_id))
    if ends:
        return  # that other states are not reached may follow from it
    if stuck:
        problems.add(states[stuck[0]].place, Message("state.never_finishes", state=stuck[0]))
        return
    entered = _reached(start, _successors(states, by_leaf, pauses=True))
    for state_id in _never_entered(mission.states, entered):
        if entry_of(states, state_id) in entered:
            continue  # it follows one that was reported
        entered |= _reached([entry_of(states, state_id)], successors)
        problems.add(states[state_id].place, Message("state.unreachable", state=state_id))


def _never_entered(around: tuple[State, ...], entered: set[str]) -> list[str]:
    """States of which no leaf is entered; a superstate instead of its states."""
    found = []
    for state in around:
        own = [leaf.state.id for leaf in leaves((state,))]
        if not entered.intersection(own):
            found.append(state.id)
        else:
            found += _never_entered(state.states, entered)
    return found


def _successors(states: dict[str, State], by_leaf: dict[str, Leaf], *, pauses: bool) -> dict[str, list[str]]:
    """For each leaf those that can follow it, by transitions and, with `pauses`, after a pause."""
    found = {}
    for leaf_id, leaf in by_leaf.items():
        targets = [transition.to for transition in leaf.transitions]
        if pauses and leaf.resume:
            targets.append(leaf.resume.to)
        outer = states.get(leaf_id.rpartition(".")[0])
        if states[leaf_id].final and outer is not None and outer.then:
            targets.append(outer.then.to)
        found[leaf_id] = [entry_of(states, target) for target in targets]
    return found


def _reached(start: list[str], successors: dict[str, list[str]]) -> set[str]:
    """Leaves that can be reached from some, including these."""
    seen: set[str] = set()
    pending = list(start)
    while pending:
        current = pending.pop()
        if current not in seen:
            seen.add(current)
            pending += successors.get(current, [])
    return seen
