"""Expansion: what a mission extends is taken in, templates become states, names become full ids.

    red: {use: cross_frame, then: green}

becomes the superstate `red` with the states of the template `cross_frame` as `red.go_to_center`,
`red.turning`, ... A target is looked up within the state, beside it, in the superstates around
it, then as a full id. The result is what is checked, flown and drawn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from difflib import get_close_matches

from offboard.chart.problems import MissionError, Place, Problem, ProblemList, cut
from offboard.chart.spec import MissionFile, State, all_states

MAX_EXTENDS = 5
MAX_STATES = 1000


def merge_extended(mission: MissionFile, open_base: Callable[[MissionFile], MissionFile]) -> MissionFile:
    """Take in what a mission extends: variables, templates and states of the same name are replaced.

    Args:
        mission: the file as read.
        open_base: reads the file that a mission extends.

    Raises:
        MissionError: a circle or a chain too long.
    """
    chain = [mission]
    while chain[-1].extends:
        base = open_base(chain[-1])
        if base.path in [known.path for known in chain] or len(chain) > MAX_EXTENDS:
            place = chain[-1].place
            text = f"extends '{chain[-1].extends}': runs in a circle or too deep"
            raise MissionError([Problem(place, text)])
        chain.append(base)
    merged = chain.pop()
    while chain:
        merged = _merge(merged, chain.pop())
    return merged


def _merge(base: MissionFile, top: MissionFile) -> MissionFile:
    replaced = {state.id: state for state in top.states}
    kept = tuple(replaced.pop(state.id, state) for state in base.states)
    return replace(
        top,
        extends="",
        initial=top.initial or base.initial,
        initial_place=top.initial_place if top.initial else base.initial_place,
        description=top.description or base.description,
        variables={**base.variables, **top.variables},
        templates={**base.templates, **top.templates},
        states=kept + tuple(replaced.values()),
    )


def expand(mission: MissionFile, problems: ProblemList) -> MissionFile:
    """Give every state its full id and every transition its full target.

    Args:
        mission: merged with what it extends.
        problems: takes unknown templates, initial states and targets.
    """
    used: set[str] = set()
    states = tuple(_instance(state, mission.templates, used, problems) for state in mission.states)
    for name in sorted(set(mission.templates) - used):
        problems.add(mission.templates[name].place, f"template '{name}' is not used; remove it or 'use' it")
    states = tuple(_with_ids(state, "") for state in states)
    known = all_states(states)
    if len(known) > MAX_STATES:
        raise MissionError([Problem(mission.place, f"has {len(known)} states; {MAX_STATES} are the limit")])
    ids = {state.id for state in known}
    return replace(mission, states=tuple(_resolved(state, ids, problems) for state in states), templates={})


def _instance(state: State, templates: dict[str, State], used: set[str], problems: ProblemList) -> State:
    inner = tuple(_instance(child, templates, used, problems) for child in state.states)
    state = replace(state, states=inner)
    if not state.use:
        return state
    template = templates.get(state.use)
    if template is None:
        known = ", ".join(templates) or "none"
        text = f"state '{state.id}' uses the unknown template '{state.use}'; known: {known}"
        problems.add(state.place, text)
        return replace(state, use="")
    used.add(state.use)
    for child in all_states(template.states):
        if child.use:
            problems.add(child.place, f"state '{child.id}': 'use' is not possible within a template")
    if state.states or state.initial:
        problems.add(state.place, f"state '{state.id}' has 'use' and states of its own; choose one")
    return replace(
        state,
        use="",
        initial=template.initial,
        initial_place=template.initial_place,
        resume=state.resume or template.resume,
        states=template.states,
        enter=state.enter + template.enter,
        during=state.during + template.during,
        exit=state.exit + template.exit,
        transitions=state.transitions + template.transitions,
    )


def _with_ids(state: State, outer: str) -> State:
    full = f"{outer}.{state.id}" if outer else state.id
    return replace(state, id=full, states=tuple(_with_ids(child, full) for child in state.states))


def _resolved(state: State, ids: set[str], problems: ProblemList) -> State:
    def target(name: str, place: Place, what: str) -> str:
        found = _look_up(name, state.id, ids)
        if found:
            return found
        near = get_close_matches(name.lower(), sorted({known.rpartition(".")[2] for known in ids} | ids), 1)
        beside = [known for known in sorted(ids) if known.rpartition(".")[0] == state.id.rpartition(".")[0]]
        mend = f"did you mean '{near[0]}'?" if near else f"there are {cut(', '.join(beside), 100)}"
        problems.add(place, f"{what} '{cut(name, 40)}' of state '{state.id}' is not a state; {mend}")
        return name

    transitions = tuple(replace(t, to=target(t.to, t.place, "target")) for t in state.transitions)
    resume = state.resume and replace(
        state.resume, to=target(state.resume.to, state.resume.place, "'resume'")
    )
    return replace(
        state,
        resume=resume,
        then=target(state.then, state.then_place, "'then'") if state.then else "",
        transitions=transitions,
        states=tuple(_resolved(child, ids, problems) for child in state.states),
    )


def _look_up(name: str, source: str, ids: set[str]) -> str:
    """Full id of a target as seen from a state: within it, beside it, then outwards."""
    outer = source
    while outer:
        candidate = f"{outer}.{name}"
        if candidate in ids:
            return candidate
        outer = outer.rpartition(".")[0]
    return name if name in ids else ""
