"""Checks an expanded chart: names, expressions, initial states, and that each state is reached and left."""

from __future__ import annotations

from collections.abc import Iterator

from offboard.chart.expressions import (
    IN_LOCATION,
    ExpressionError,
    check_assignment,
    check_guard,
    names_in,
)
from offboard.chart.problems import Place, ProblemList, cut, did_you_mean
from offboard.chart.spec import Action, Leaf, MissionFile, State, Transition, all_states, leaves
from offboard.chart.vocabulary import UnknownNameError, Vocabulary
from offboard.pilot import NAMES_ON_MAP, Pilot


def check(mission: MissionFile, pilot_class: type[Pilot], problems: ProblemList) -> None:
    """Check an expanded mission, and its names against a pilot class; `problems` takes what is found."""
    vocabulary = Vocabulary(pilot_class, mission.variables, contest=mission.mission_class != "open")
    if not mission.states:
        problems.add(mission.place, "has no 'states'; write 'states:' and below it the states, indented")
        return
    expanded_without_problems = not problems.found
    for state in all_states(mission.states):
        _check_names(state, vocabulary, problems)
    if not expanded_without_problems:
        return  # what follows would report the same faults again
    _check_initial(mission.place, "the mission", mission, problems)
    for state in all_states(mission.states):
        _check_shape(state, problems)
    if not problems.found:
        _check_vision(mission, pilot_class, problems)
    if not problems.found:
        _check_paths(mission, problems)


def _check_initial(place: Place, what: str, around: MissionFile | State, problems: ProblemList) -> None:
    names, initial = [state.name for state in around.states], around.initial
    if not initial:
        problems.add(place, f"{what} has no 'initial'; name the state it starts in, such as '{names[0]}'")
    elif initial not in names:
        advice = did_you_mean(initial, names, f"it has the states {cut(', '.join(names), 100)}")
        problems.add(around.initial_place, f"'initial' of {what} is '{cut(initial, 40)}'; {advice}")


def _check_shape(state: State, problems: ProblemList) -> None:
    place = state.place
    if state.states:
        _check_initial(place, f"state '{state.id}'", state, problems)
        if state.final:
            problems.add(place, f"state '{state.id}' is final and has states; only one of both is possible")
        ends = any(child.final for child in state.states)
        if state.then and not ends:
            text = f"none of the states of '{state.id}' has 'final: true', so its 'then' is never reached"
            problems.add(state.states[-1].place, text)
        return
    if state.then or state.initial:
        problems.add(place, f"state '{state.id}' has 'then' or 'initial' but no states of its own")
    if state.final and state.resume:
        text = f"state '{state.id}' is final; there is nothing to continue, remove 'resume'"
        problems.add(state.resume.place, text)
    if state.final and (state.transitions or state.during):
        problems.add(place, f"state '{state.id}' is final; nothing happens after its 'enter'")
    _check_transitions(state, problems)


def _check_transitions(state: State, problems: ProblemList) -> None:
    """No transition is hidden by one above it."""
    seen: dict[str, Transition] = {}
    for transition in state.transitions:
        if "" in seen:
            text = f"this transition of '{state.id}' is never reached: the one above always holds"
            problems.add(transition.when_place, text)
            return
        guard = " ".join(transition.when.split())
        if guard in seen:
            line = seen[guard].when_place.line
            text = f"this transition of '{state.id}' is never reached: line {line} has the same 'when'"
            problems.add(transition.when_place, text)
        seen.setdefault(guard, transition)


def _check_names(state: State, vocabulary: Vocabulary, problems: ProblemList) -> None:
    for transition in state.transitions:
        if transition.when:
            try:
                check_guard(transition.when, vocabulary)
            except ExpressionError as error:
                place = transition.when_place.moved(error.offset)
                problems.add(place, f"when '{cut(transition.when)}': {error}")
    for action in (*state.enter, *state.during, *state.exit):
        _check_action(action, vocabulary, problems)


def _check_action(action: Action, vocabulary: Vocabulary, problems: ProblemList) -> None:
    try:
        if action.name:
            vocabulary.check_primitive(action.name)
        else:
            check_assignment(action.location, action.expression, vocabulary)
    except UnknownNameError as error:
        problems.add(action.place, str(error))
    except ExpressionError as error:
        in_location = error.offset == IN_LOCATION
        place = action.place if in_location else action.expression_place.moved(error.offset)
        problems.add(place, f"'{cut(str(action))}': {error}")


def _check_vision(mission: MissionFile, pilot_class: type[Pilot], problems: ProblemList) -> None:
    """The map is only used by missions that see frames; the first use is reported."""
    if mission.vision == "frames":
        return
    for state in all_states(mission.states):
        for place, name in _names_used(state):
            if name in NAMES_ON_MAP and getattr(pilot_class, name) is getattr(Pilot, name):
                advice = f"add the line 'vision: frames' at the top of {mission.path.name}"
                problems.add(place, f"'{name}' needs the map of frames; {advice}")
                return


def _names_used(state: State) -> Iterator[tuple[Place, str]]:
    """Primitives and values of the pilot that a state uses, and where."""
    for action in (*state.enter, *state.during, *state.exit):
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
    start = [_entry(states, mission.initial)]
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
        text = f"state '{leaf_id}' has no way out; add 'transitions:', or 'final: true' if it is the end"
        problems.add(states[leaf_id].place, text)
    if ends:
        return  # that other states are not reached may follow from it
    if stuck:
        text = f"never finishes: no way from state '{stuck[0]}' to a final state"
        advice = "add a transition to one, or mark a state with 'final: true'"
        problems.add(states[stuck[0]].place, f"{text}; {advice}")
        return
    entered = _reached(start, _successors(states, by_leaf, pauses=True))
    for state_id in _never_entered(mission.states, entered):
        if _entry(states, state_id) in entered:
            continue  # it follows one that was reported
        entered |= _reached([_entry(states, state_id)], successors)
        place = states[state_id].place
        problems.add(place, f"state '{state_id}' is never reached; add a transition to it, or remove it")


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
            targets.append(outer.then)
        found[leaf_id] = [_entry(states, target) for target in targets]
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


def is_finish(states: dict[str, State], leaf_id: str) -> bool:
    """Whether the mission is over in this leaf: it is final and its superstate has no `then`."""
    outer = states.get(leaf_id.rpartition(".")[0])
    return states[leaf_id].final and (outer is None or not outer.then)


def _entry(states: dict[str, State], state_id: str) -> str:
    """The leaf that is active after entering a state."""
    while states[state_id].states:
        state_id = f"{state_id}.{states[state_id].initial}"
    return state_id
