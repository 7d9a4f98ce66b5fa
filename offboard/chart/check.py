"""What must hold of an expanded chart: names, expressions, initial states, ways in and ways out."""

from __future__ import annotations

from offboard.chart.expressions import ExpressionError, check_assignment, check_expression
from offboard.chart.problems import Place, ProblemList
from offboard.chart.spec import Action, Leaf, MissionFile, State, all_states, leaves
from offboard.chart.vocabulary import UnknownNameError, Vocabulary
from offboard.pilot import Pilot


def check(mission: MissionFile, pilot_class: type[Pilot], problems: ProblemList) -> None:
    """Check an expanded mission against the pilot.

    Args:
        mission: expanded.
        pilot_class: what the mission's names are compared with.
        problems: takes what is found, each by line.
    """
    vocabulary = Vocabulary(pilot_class, mission.variables)
    if not mission.states:
        problems.add(mission.place, "has no 'states'")
        return
    _check_initial(mission.place, "the mission", mission.initial, mission.states, problems)
    for state in all_states(mission.states):
        _check_shape(state, problems)
        _check_words(state, vocabulary, problems)
    if not problems.found:
        _check_reachable(mission, problems)


def _check_initial(
    place: Place, what: str, initial: str, states: tuple[State, ...], problems: ProblemList
) -> None:
    names = [state.name for state in states]
    if not initial:
        problems.add(place, f"{what} has no 'initial'; name the state it starts in, such as '{names[0]}'")
    elif initial not in names:
        problems.add(place, f"'initial' of {what} is '{initial}'; it has the states {', '.join(names)}")


def _check_shape(state: State, problems: ProblemList) -> None:
    place = state.place
    if state.states:
        _check_initial(place, f"state '{state.id}'", state.initial, state.states, problems)
        if state.final:
            problems.add(place, f"state '{state.id}' is final and has states; only one of both is possible")
        ends = any(child.final for child in state.states)
        if state.then and not ends:
            problems.add(place, f"state '{state.id}' has 'then' but no final state that leads there")
        return
    if state.then or state.initial:
        problems.add(place, f"state '{state.id}' has 'then' or 'initial' but no states of its own")
    if state.final and state.resume:
        text = f"state '{state.id}' is final; nothing is left to go on with, take 'resume' away"
        problems.add(state.resume.place, text)
    if state.final and (state.transitions or state.during):
        problems.add(place, f"state '{state.id}' is final; nothing happens after its 'enter'")
    always = [index for index, transition in enumerate(state.transitions) if not transition.when]
    if always and always[0] < len(state.transitions) - 1:
        late = state.transitions[always[0] + 1].place
        problems.add(late, f"this transition of '{state.id}' is never reached: the one above always holds")


def _check_words(state: State, vocabulary: Vocabulary, problems: ProblemList) -> None:
    for transition in state.transitions:
        if transition.when:
            try:
                check_expression(transition.when, vocabulary)
            except ExpressionError as error:
                problems.add(transition.place, f"guard '{transition.when}': {error}")
    for action in (*state.enter, *state.during, *state.exit):
        _check_action(action, vocabulary, problems)


def _check_action(action: Action, vocabulary: Vocabulary, problems: ProblemList) -> None:
    try:
        if action.name:
            vocabulary.check_primitive(action.name)
        else:
            check_assignment(action.location, action.expression, vocabulary)
    except (UnknownNameError, ExpressionError) as error:
        problems.add(action.place, str(error) if action.name else f"'{action}': {error}")


def _check_reachable(mission: MissionFile, problems: ProblemList) -> None:
    """Every leaf can be entered, and from the start a finish can be reached by some way, without a pause."""
    states = {state.id: state for state in all_states(mission.states)}
    by_leaf = {leaf.state.id: leaf for leaf in leaves(mission.states)}
    entered = _reached(mission.initial, states, by_leaf, pauses=True)
    for leaf_id, leaf in by_leaf.items():
        if leaf_id not in entered:
            problems.add(leaf.state.place, f"state '{leaf_id}' is never reached; lead a transition to it")
    unpaused = _reached(mission.initial, states, by_leaf, pauses=False)
    if not any(is_finish(states, leaf_id) for leaf_id in unpaused):
        problems.add(mission.place, "never finishes: no final state ends it; mark one with 'final: true'")


def _reached(initial: str, states: dict[str, State], by_leaf: dict[str, Leaf], *, pauses: bool) -> set[str]:
    """The leaves that can be entered from the start, by transitions and, if wanted, after pauses."""
    seen: set[str] = set()
    pending = [_entry(states, initial)]
    while pending:
        current = pending.pop()
        if current in seen:
            continue
        seen.add(current)
        leaf = by_leaf[current]
        targets = [transition.to for transition in leaf.transitions]
        if pauses and leaf.resume:
            targets.append(leaf.resume.to)
        outer = states.get(current.rpartition(".")[0])
        if states[current].final and outer is not None and outer.then:
            targets.append(outer.then)
        pending += [_entry(states, target) for target in targets]
    return seen


def is_finish(states: dict[str, State], leaf_id: str) -> bool:
    """Whether the mission is over in this state: it is final and nothing follows its superstate.

    Args:
        states: all states of the expanded chart by full id.
        leaf_id: one of them.
    """
    outer = states.get(leaf_id.rpartition(".")[0])
    return states[leaf_id].final and (outer is None or not outer.then)


def _entry(states: dict[str, State], state_id: str) -> str:
    """The leaf that is active after entering a state."""
    while states[state_id].states:
        state_id = f"{state_id}.{states[state_id].initial}"
    return state_id
