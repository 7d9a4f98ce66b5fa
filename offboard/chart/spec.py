"""A mission as data: what its file says, and its expansion to the chart that is checked, flown and drawn.

Expansion merges what a mission extends, replaces templates by states and names by full ids:

    red: {use: cross_frame, then: green}

becomes the superstate `red` with the states of the template `cross_frame` as `red.go_to_center`,
`red.turning`, ... A target is looked up within the state, beside it, in the superstates around
it, then as a full id.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from framerunner.files.yaml_text import Place
from framerunner.geometry.gate_shape import GateShape
from offboard.chart.mission_texts import Message
from offboard.chart.problems import NOWHERE, ProblemList, cut, did_you_mean, mission_error
from scenarios.models import MissionClass
from vision.types import Vision

MAX_EXTENDS = 5
MAX_STATES = 1000
MAX_PARTS = 20_000
"""Transitions and actions of all states, each with those of the superstates around it."""
MAX_CHARACTERS = 100_000
"""Of the expressions of all states, counted likewise."""
THEN, RESUME = "then", "resume"
Event = Literal["tick", "done", "resume"]
"""When a transition is looked at: at every tick, when a final state is reached (`then`), after a pause."""


@dataclass(frozen=True, slots=True)
class Action:
    """One line of `enter`, `exit` or `during`: a primitive by name, or `location = expression`."""

    place: Place = field(compare=False, repr=False)
    name: str = ""  # of the primitive; empty for an assignment
    location: str = ""  # what is assigned to, dotted; empty for a primitive
    expression: str = ""
    expression_place: Place = field(default=NOWHERE, compare=False, repr=False)

    def __str__(self) -> str:
        return self.name or f"{self.location} = {self.expression}"


@dataclass(frozen=True, slots=True)
class Transition:
    """One way out of a state."""

    place: Place = field(compare=False, repr=False)  # of its target
    to: str  # the target as written; after expansion, a full state id
    when: str = ""  # the guard; empty for "always"
    when_place: Place = field(default=NOWHERE, compare=False, repr=False)  # without a guard, of itself
    actions: tuple[Action, ...] = ()  # done after leaving the state and before entering the target
    id: str = ""  # after expansion, see `transition_id`


@dataclass(frozen=True, slots=True)
class State:
    """A state or, if it has states of its own, a superstate."""

    place: Place = field(compare=False, repr=False)  # of its name
    id: str  # name as written; after expansion the full id ("red.turning")
    initial: str = ""  # the state a superstate starts in
    initial_place: Place = field(default=NOWHERE, compare=False, repr=False)
    final: bool = False
    then: Transition | None = None  # of a superstate, taken when one of its final states is reached
    use: str = ""  # the template whose states it takes; empty after expansion
    resume: Transition | None = None  # where the mission continues after a pause; None: where it was
    enter: tuple[Action, ...] = ()
    during: tuple[Action, ...] = ()
    exit: tuple[Action, ...] = ()
    transitions: tuple[Transition, ...] = ()
    states: tuple[State, ...] = ()

    @property
    def name(self) -> str:
        """Last part of the id."""
        return self.id.rpartition(".")[2]

    def outgoing(self) -> Iterator[tuple[Event, int, Transition]]:
        """All its transitions: event, order of priority among those of the event, and transition."""
        for order, transition in enumerate(self.transitions):
            yield "tick", order, transition
        if self.then is not None:
            yield "done", 0, self.then
        if self.resume is not None:
            yield "resume", 0, self.resume


@dataclass(frozen=True, slots=True)
class MissionFile:
    """A mission file as written."""

    place: Place
    path: Path
    name: str = ""
    description: str = ""
    mission_class: MissionClass | None = None  # None: not given
    vision: Vision | None = None  # None: not given
    detector: str = ""  # of another package, instead of the vision's own
    detector_place: Place = NOWHERE
    gate: GateShape | None = None  # of colours of which the scenario tells nothing; None: not given
    extends: str = ""
    initial: str = ""
    initial_place: Place = NOWHERE
    variables: dict[str, object] = field(default_factory=dict)
    templates: dict[str, State] = field(default_factory=dict)
    states: tuple[State, ...] = ()


@dataclass(frozen=True, slots=True)
class Leaf:
    """A state without states of its own, with everything that holds while it is active."""

    state: State
    transitions: tuple[Transition, ...]  # its own, then those of the superstates, in order of priority
    during: tuple[Action, ...]  # its own, then those of the superstates
    resume: Transition | None  # its own or, without one, that of the nearest superstate that has one


def transition_id(state: str, which: int | str) -> str:
    """The id of a transition: full id of the state that declares it, and which of its transitions it is.

    Args:
        state: such as "red.turning"; a superstate's transition has the superstate's id wherever it is taken.
        which: its number in the document, from 1, as diagrams show it; `THEN` or `RESUME`.

    Returns:
        Such as "red.turning/2", "red/then" or "red/resume".
    """
    return f"{state}/{which}"


def leaves(states: tuple[State, ...], outer: tuple[State, ...] = ()) -> list[Leaf]:
    """All states without states of their own; `outer` are the superstates around, innermost first."""
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


def entry_of(states: Mapping[str, State], state_id: str) -> str:
    """The leaf that is active after entering a state, by full ids, before any `then` is followed."""
    while states[state_id].states:
        state_id = f"{state_id}.{states[state_id].initial}"
    return state_id


def is_finish(states: Mapping[str, State], leaf_id: str) -> bool:
    """Whether the mission is over in this leaf: it is final and its superstate has no `then`."""
    outer = states.get(leaf_id.rpartition(".")[0])
    return states[leaf_id].final and (outer is None or not outer.then)


def state_path(state: str) -> tuple[str, ...]:
    """Full ids of the superstates around a state and of the state itself, outermost first; none of ""."""
    parts = state.split(".") if state else []
    return tuple(".".join(parts[:number]) for number in range(1, len(parts) + 1))


def all_states(states: tuple[State, ...]) -> list[State]:
    """All states of a chart, superstates before their own, in document order."""
    return [found for state in states for found in (state, *all_states(state.states))]


def merge_extended(mission: MissionFile, open_base: Callable[[MissionFile], MissionFile]) -> MissionFile:
    """Merge a mission with what it extends: variables, templates and states of the same name are replaced.

    Raises:
        MissionError: missions that extend each other, or a chain that is too long.
    """
    chain = [mission]
    while chain[-1].extends:
        base = open_base(chain[-1])
        if base.path in [known.path for known in chain] or len(chain) > MAX_EXTENDS:
            raise mission_error(chain[-1].place, Message("extends.circle", name=chain[-1].extends))
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
        mission_class=top.mission_class or base.mission_class,
        vision=top.vision or base.vision,
        detector=top.detector or base.detector,
        detector_place=top.detector_place if top.detector else base.detector_place,
        gate=top.gate or base.gate,
        variables={**base.variables, **top.variables},
        templates={**base.templates, **top.templates},
        states=kept + tuple(replaced.values()),
    )


def expand(mission: MissionFile, problems: ProblemList) -> MissionFile:
    """Give every state of a merged mission its full id and every transition its full target.

    Raises:
        MissionError: too many states; all else is added to `problems`.
    """
    _refuse_too_large(mission)
    used: set[str] = set()
    states = tuple(_instance(state, mission.templates, used, problems) for state in mission.states)
    for name in sorted(set(mission.templates) - used):
        problems.add(mission.templates[name].place, Message("template.unused", name=name))
    states = tuple(_with_ids(state, "") for state in states)
    ids = {state.id for state in all_states(states)}
    return replace(mission, states=tuple(_resolved(state, ids, problems) for state in states), templates={})


def _refuse_too_large(mission: MissionFile) -> None:
    """Count what the expansion would make, before it is made."""
    states = parts = characters = 0

    def count(state: State, around: tuple[int, int], *, in_template: bool) -> None:
        nonlocal states, parts, characters
        template = None if in_template else mission.templates.get(state.use)
        written = (state,) if template is None else (state, template)
        inner = [(child, each is template) for each in written for child in each.states]
        inherited = [size(each.transitions, each.during) for each in written]
        own = (around[0] + sum(one for one, _ in inherited), around[1] + sum(two for _, two in inherited))
        once = [size((), each.enter + each.exit) for each in written]
        states += 1
        parts += sum(one for one, _ in once) + (0 if inner else own[0])
        characters += sum(two for _, two in once) + (0 if inner else own[1])
        for child, of_template in inner if states <= MAX_STATES else ():
            count(child, own, in_template=in_template or of_template)

    def size(transitions: tuple[Transition, ...], actions: tuple[Action, ...]) -> tuple[int, int]:
        all_actions = [*actions, *(action for each in transitions for action in each.actions)]
        texts = [*(each.when for each in transitions), *(each.expression for each in all_actions)]
        return len(transitions) + len(all_actions), sum(map(len, texts))

    for state in mission.states:
        count(state, (0, 0), in_template=False)
    if states > MAX_STATES:
        raise mission_error(mission.place, Message("chart.too_many", count=states, limit=MAX_STATES))
    if parts > MAX_PARTS:
        raise mission_error(mission.place, Message("chart.too_many_parts", count=parts, limit=MAX_PARTS))
    if characters > MAX_CHARACTERS:
        message = Message("chart.too_much_text", count=characters, limit=MAX_CHARACTERS)
        raise mission_error(mission.place, message)


def _instance(state: State, templates: dict[str, State], used: set[str], problems: ProblemList) -> State:
    """The state with the states and actions of its template."""
    inner = tuple(_instance(child, templates, used, problems) for child in state.states)
    state = replace(state, states=inner)
    if not state.use:
        return state
    template = templates.get(state.use)
    if template is None:
        known = ", ".join(templates) or "none"
        message = Message("template.unknown", state=state.id, name=cut(state.use), known=known)
        problems.add(state.place, message)
        return replace(state, use="")
    used.add(state.use)
    for child in all_states(template.states):
        if child.use:
            problems.add(child.place, Message("template.use", state=child.id))
    if state.states or state.initial:
        problems.add(state.place, Message("template.both", state=state.id))
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
    def target(name: str, place: Place, what: Message | str) -> str:
        found = look_up(name, state.id, ids)
        if found or problems.full:
            return found or name
        beside = [known for known in sorted(ids) if known.rpartition(".")[0] == state.id.rpartition(".")[0]]
        names = sorted({known.rpartition(".")[2] for known in ids} | ids)
        advice = did_you_mean(
            name.lower(), names, Message("target.beside", names=cut(", ".join(beside), 100))
        )
        message = Message("target.unknown", what=what, name=cut(name, 40), state=state.id, advice=advice)
        problems.add(place, message)
        return name

    def with_target(transition: Transition, which: int | str, what: Message | str) -> Transition:
        to = target(transition.to, transition.place, what)
        return replace(transition, to=to, id=transition_id(state.id, which))

    return replace(
        state,
        resume=state.resume and with_target(state.resume, RESUME, "'resume'"),
        then=state.then and with_target(state.then, THEN, "'then'"),
        transitions=tuple(
            with_target(each, number, Message("target.what"))
            for number, each in enumerate(state.transitions, 1)
        ),
        states=tuple(_resolved(child, ids, problems) for child in state.states),
    )


def look_up(name: str, source: str, ids: set[str]) -> str:
    """Full id of a target as seen from a state: within it, beside it, then outwards; empty if unknown."""
    outer = source
    while outer:
        candidate = f"{outer}.{name}"
        if candidate in ids:
            return candidate
        outer = outer.rpartition(".")[0]
    return name if name in ids else ""
