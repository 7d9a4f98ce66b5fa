"""Where each state, transition and action of a mission stands in its text.

A state is named by its path as written: `red`, `landing.stop`; a state of a template with the template
first: `@cross_frame.turning`; the template itself is `@cross_frame`.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from framerunner.files.yaml_text import ListNode, MapNode, Node, Scalar
from offboard.chart.problems import NOWHERE
from offboard.chart.spec import Event

Section = Literal["enter", "during", "exit"]
KEYS: Mapping[Event, str] = {"done": "then", "resume": "resume"}
"""Of transitions that are not in a list."""
SECTIONS: tuple[Section, ...] = ("enter", "during", "exit")
TEMPLATE = "@"


@dataclass(frozen=True, slots=True)
class Span:
    """A part of a text: offsets of its first character and of the one after its last."""

    start: int
    end: int


@dataclass(frozen=True, slots=True)
class TransitionOutline:
    """A transition as written.

    Attributes:
        event: see `Event`; only those of "tick" have a guard, actions and an order.
        index: among the state's transitions of "tick", from 0, in order of priority.
        node: of "tick" the mapping with `when`, `to` and `do`; otherwise the target.
        to: the target; None if it is missing.
        when: the guard; None if there is none.
    """

    event: Event
    index: int
    node: Node
    to: Scalar | None
    when: Scalar | None = None
    actions: tuple[Scalar, ...] = ()


@dataclass(frozen=True, slots=True)
class StateOutline:
    """A state or template as written.

    Attributes:
        path: see above.
        container: the mapping whose entry it is.
        key: its name.
        node: what stands below its name; an empty scalar if nothing does.
        states: its own states.
    """

    path: str
    container: MapNode
    key: Scalar
    node: Node
    states: tuple[StateOutline, ...]
    transitions: tuple[TransitionOutline, ...]

    @property
    def name(self) -> str:
        """Last part of the path, without the sign of a template."""
        return self.key.text

    @property
    def parent(self) -> str:
        """Path of the state or template around it; empty at the top."""
        return self.path.rpartition(".")[0]

    @property
    def is_template(self) -> bool:
        """Whether it is a template itself, not a state of one."""
        return self.path.startswith(TEMPLATE) and not self.parent

    @property
    def span(self) -> Span:
        """From the first character of its name to the last of its content."""
        return Span(self.key.start, max(self.key.end, self.node.end))

    def entry(self, key: str) -> Node | None:
        """The value of one of its keys; None if it has none."""
        return self.node.items.get(key) if isinstance(self.node, MapNode) else None

    def text(self, key: str) -> str:
        """The text of one of its keys; empty if it has none."""
        node = self.entry(key)
        return node.text.strip() if isinstance(node, Scalar) else ""

    def actions(self, section: Section) -> tuple[Scalar, ...]:
        """The actions of a section."""
        return scalars(self.entry(section))

    def all(self) -> Iterator[StateOutline]:
        """This one and the states in it, in the order of the text."""
        yield self
        for child in self.states:
            yield from child.all()


class Outline:
    """All states and templates of a mission's text.

    Args:
        root: its nodes; None if there is nothing but comments.

    Attributes:
        states: at the top, in the order of the text.
        templates: likewise.
    """

    def __init__(self, root: MapNode | None) -> None:
        self.root = root if root is not None else MapNode(NOWHERE, {}, {})
        self.states = _states(self.root, "states", "")
        self.templates = _states(self.root, "templates", TEMPLATE)
        self._by_path = {state.path: state for top in (*self.templates, *self.states) for state in top.all()}

    def __iter__(self) -> Iterator[StateOutline]:
        return iter(self._by_path.values())

    def get(self, path: str) -> StateOutline | None:
        """The state with a path, if there is one."""
        return self._by_path.get(path)

    def states_in(self, parent: str) -> tuple[StateOutline, ...]:
        """The states of a state or template; those at the top of an empty path."""
        around = self._by_path.get(parent)
        return self.states if around is None else around.states

    def at(self, offset: int) -> StateOutline | None:
        """The innermost state around an offset."""
        starts, states = self._by_start
        number = bisect_right(starts, offset) - 1
        state = states[number] if number >= 0 else None
        while state is not None and state.span.end < offset:
            state = self._by_path.get(state.parent)
        return state

    @cached_property
    def _by_start(self) -> tuple[list[int], list[StateOutline]]:
        """All states in the order of the text, with where they start; inner ones after those around them."""
        states = sorted(self._by_path.values(), key=lambda state: state.key.start)
        return [state.key.start for state in states], states

    def text(self, key: str) -> str:
        """The text of a key of the mission; empty if it has none."""
        node = self.root.items.get(key)
        return node.text.strip() if isinstance(node, Scalar) else ""

    @property
    def variables(self) -> dict[str, Scalar]:
        """The variables' values by name."""
        node = self.root.items.get("variables")
        items = node.items if isinstance(node, MapNode) else {}
        return {name: value for name, value in items.items() if isinstance(value, Scalar)}


def scalars(node: Node | None) -> tuple[Scalar, ...]:
    """The texts of a list; none if it is something else."""
    items = node.items if isinstance(node, ListNode) else ()
    return tuple(item for item in items if isinstance(item, Scalar))


def _states(node: Node, key: str, prefix: str) -> tuple[StateOutline, ...]:
    container = node.items.get(key) if isinstance(node, MapNode) else None
    if not isinstance(container, MapNode):
        return ()
    return tuple(_state(container, name, prefix + name) for name in container.items)


def _state(container: MapNode, name: str, path: str) -> StateOutline:
    node = container.items[name]
    states = _states(node, "states", f"{path}.")
    return StateOutline(path, container, container.key_nodes[name], node, states, _transitions(node))


def _transitions(node: Node) -> tuple[TransitionOutline, ...]:
    if not isinstance(node, MapNode):
        return ()
    found = []
    written = node.items.get("transitions")
    for index, item in enumerate(written.items if isinstance(written, ListNode) else ()):
        if isinstance(item, MapNode):
            to, when = (_scalar(item.items.get(key)) for key in ("to", "when"))
            found.append(TransitionOutline("tick", index, item, to, when, scalars(item.items.get("do"))))
    for event, key in KEYS.items():
        target = _scalar(node.items.get(key))
        if target is not None:
            found.append(TransitionOutline(event, 0, target, target))
    return tuple(found)


def _scalar(node: Node | None) -> Scalar | None:
    return node if isinstance(node, Scalar) and node.text else None
