"""Which states the transitions of a document lead to, so that they still do after a change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from framerunner.files.yaml_text import Place, Scalar
from offboard.authoring.document import Document
from offboard.authoring.outline import TEMPLATE, StateOutline
from offboard.chart.spec import Event, all_states, look_up


@dataclass(frozen=True, slots=True)
class TargetReference:
    """A transition's target as written.

    Attributes:
        state: path of the state that has the transition.
        event, index: which one.
        target: what is written.
        leads: from which full id to which; a template's has one for each use. None if there is no such state.
    """

    state: str
    event: Event
    index: int
    target: Scalar
    leads: frozenset[tuple[str, str]]

    @property
    def key(self) -> tuple[str, Event, int]:
        """Which transition it is."""
        return self.state, self.event, self.index


def references(document: Document) -> dict[tuple[str, Event, int], TargetReference]:
    """All references of a document that lead to states."""
    leads = _leads(document)
    found = {}
    for state in document.outline:
        for transition in state.transitions:
            if transition.to is not None and leads.get(transition.to.place):
                reference = TargetReference(
                    state.path,
                    transition.event,
                    transition.index,
                    transition.to,
                    frozenset(leads[transition.to.place]),
                )
                found[reference.key] = reference
    return found


def _leads(document: Document) -> dict[Place, set[tuple[str, str]]]:
    if document.chart is None:
        return {}
    states = all_states(document.chart.states)
    ids = {state.id for state in states}
    found: dict[Place, set[tuple[str, str]]] = {}
    for state in states:
        for _, _, transition in state.outgoing():
            if transition.place.file == document.label and transition.to in ids:
                found.setdefault(transition.place, set()).add((state.id, transition.to))
    return found


def chart_ids(document: Document) -> set[str]:
    """Full ids of all states of the expanded chart."""
    return set() if document.chart is None else {state.id for state in all_states(document.chart.states)}


def instances(document: Document, state: StateOutline) -> tuple[str, ...]:
    """Full ids of a written state in the chart: of a template's state one for each use of the template.

    A template itself has those of the states that use it.
    """
    if document.chart is None:
        return ()
    states = all_states(document.chart.states)
    if not state.is_template:
        return tuple(each.id for each in states if each.place == state.key.place)
    if state.states:
        return tuple(each.rpartition(".")[0] for each in instances(document, state.states[0]))
    users = [each for each in document.outline if each.text("use") == state.name]
    return tuple(each for user in users for each in instances(document, user))


def relative(path: str) -> str:
    """The path of a state without its template."""
    return path.partition(".")[2] if path.startswith(TEMPLATE) else path


def beside(path: str, name: str) -> str:
    """Path or full id of a state with another name beside one."""
    return f"{path.rpartition('.')[0]}.{name}".lstrip(".")


def prefix_change(pairs: list[tuple[str, str]]) -> Callable[[str], str]:
    """A function that changes how paths begin: what is under the first of a pair goes under the second."""

    def change(path: str) -> str:
        for old, new in pairs:
            if path == old or path.startswith(f"{old}."):
                return new + path[len(old) :]
        return path

    return change


def shortest_text(leads: frozenset[tuple[str, str]], ids: set[str]) -> str | None:
    """The shortest name that leads from each state to its target; None if there is none."""
    targets = [target.split(".") for _, target in leads]
    for count in range(1, min(map(len, targets)) + 1):
        names = {".".join(parts[-count:]) for parts in targets}
        name = names.pop()
        if not names and all(look_up(name, source, ids) == target for source, target in leads):
            return name
    return None
