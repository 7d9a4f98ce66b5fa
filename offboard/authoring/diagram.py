"""The diagram of a document: the expanded chart as nodes and edges that know where they are written.

What is drawn is what is flown: a state of a template is there once for each use, with the full id that the
engine reports (`red.turning`). `source` says where it is written (`@cross_frame.turning`), which is what
edits name.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from framerunner.files.yaml_text import Place, Scalar
from offboard.authoring.document import Document
from offboard.authoring.outline import Span, StateOutline, TransitionOutline
from offboard.chart.spec import Event, MissionFile, State, Transition, all_states, is_finish

SETTINGS = ("name", "description", "class", "vision", "detector", "extends")


@dataclass(frozen=True, slots=True)
class Node:
    """A state of the expanded chart.

    Attributes:
        id: full, such as "red.turning": the same as long as the state keeps its name and superstate.
        parent: id of its superstate; empty at the top.
        initial: id of the state in which it starts; empty of a plain state.
        finish: the mission is over in it.
        parameters: of a state that uses a template: what it assigns on entry before the template's actions.
        template: the one whose states it takes; empty if there is none.
        source: path of where it is written; empty if that is in another file, which cannot be edited here.
        span: of its text there, and `name_span` of its name; None in another file.
    """

    id: str
    name: str
    parent: str
    initial: str
    final: bool
    finish: bool
    enter: tuple[str, ...]
    during: tuple[str, ...]
    exit: tuple[str, ...]
    parameters: tuple[tuple[str, str], ...]
    template: str
    source: str
    span: Span | None
    name_span: Span | None


@dataclass(frozen=True, slots=True)
class Edge:
    """A transition of the expanded chart.

    Attributes:
        id: the id of the state that has it, the event, and the order of priority: "red.turning/tick/0".
        target: id of the state that it leads to; if there is no such state, what is written.
        missing: there is no such state.
        event: "tick", "done" (a final substate was reached) or "resume" (after a pause).
        order: 0 is looked at first; only among those of "tick".
        source_state, source_index: where it is written: path and index for a `TransitionPath`; an empty
            path if that is in another file.
        span: of its text there, `when_span` of its guard and `to_span` of its target, None if there is none.
    """

    id: str
    source: str
    target: str
    missing: bool
    event: Event
    order: int
    when: str
    actions: tuple[str, ...]
    source_state: str
    source_index: int
    span: Span | None
    when_span: Span | None
    to_span: Span | None


@dataclass(frozen=True, slots=True)
class Diagram:
    """All states, superstates before their own, and all transitions, in order of priority.

    Attributes:
        initial: id of the state in which the mission starts; empty if it has none.
        settings: the mission's own keys as written here: name, description, class, vision, detector, extends.
        variables: names and first values as written here.
        templates: written here, with the paths of their states; one that nothing uses has no nodes.
        readable: the text can be understood; if not there are no nodes, and a page keeps its last diagram.
    """

    name: str
    initial: str
    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]
    settings: dict[str, str] = field(default_factory=dict)
    variables: dict[str, str] = field(default_factory=dict)
    templates: dict[str, tuple[str, ...]] = field(default_factory=dict)
    readable: bool = True


def diagram(document: Document) -> Diagram:
    """The diagram of a document, as far as it can be understood."""
    chart = document.chart
    if chart is None:
        return Diagram("", "", (), (), readable=document.unreadable is None)
    written = _Written(document)
    states = {state.id: state for state in all_states(chart.states)}
    nodes = tuple(_node(state, states, written) for state in states.values())
    edges = tuple(
        _edge(state.id, transition, event, order, written, missing=transition.to not in states)
        for state in states.values()
        for event, order, transition in state.outgoing()
    )
    outline = document.outline
    return Diagram(
        chart.name,
        _initial(chart, states),
        nodes,
        edges,
        settings={key: outline.text(key) for key in SETTINGS if outline.text(key)},
        variables={name: value.text for name, value in outline.variables.items()},
        templates={each.name: tuple(state.path for state in each.all()) for each in outline.templates},
    )


def _initial(chart: MissionFile, states: dict[str, State]) -> str:
    return chart.initial if chart.initial in states else ""


class _Written:
    """Finds where a state or transition of the chart is written."""

    def __init__(self, document: Document) -> None:
        outline = document.outline
        self.states: dict[Place, StateOutline] = {state.key.place: state for state in outline}
        self.transitions: dict[Place, tuple[StateOutline, TransitionOutline]] = {
            each.to.place: (state, each) for state in outline for each in state.transitions if each.to
        }


def _node(state: State, states: dict[str, State], written: _Written) -> Node:
    own = written.states.get(state.place)
    inner = f"{state.id}.{state.initial}"
    return Node(
        state.id,
        state.name,
        state.id.rpartition(".")[0],
        inner if inner in states else "",
        state.final,
        not state.states and is_finish(states, state.id),
        tuple(map(str, state.enter)),
        tuple(map(str, state.during)),
        tuple(map(str, state.exit)),
        () if own is None else parameters(own),
        "" if own is None else own.text("use"),
        "" if own is None else own.path,
        None if own is None else own.span,
        None if own is None else _span(own.key),
    )


def parameters(state: StateOutline) -> tuple[tuple[str, str], ...]:
    """Names and values that a superstate assigns on entry: what tells a copy of it from another."""
    if not (state.states or state.text("use")):
        return ()
    pairs = [action.text.partition("=") for action in state.actions("enter")]
    return tuple((name.strip(), value.strip()) for name, sign, value in pairs if sign)


def _edge(
    source: str, transition: Transition, event: Event, order: int, written: _Written, *, missing: bool
) -> Edge:
    state, own = written.transitions.get(transition.place, (None, None))
    return Edge(
        f"{source}/{event}/{order}",
        source,
        transition.to,
        missing,
        event,
        order,
        transition.when,
        tuple(map(str, transition.actions)),
        "" if state is None else state.path,
        0 if own is None else own.index,
        None if own is None else Span(own.node.start, own.node.end),
        None if own is None or own.when is None else _span(own.when),
        None if own is None or own.to is None else _span(own.to),
    )


def _span(node: Scalar) -> Span:
    return Span(node.start, node.end)
