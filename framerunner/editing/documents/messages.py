"""What is said between the editor's page and its program: JSON, offsets counted as JavaScript does.

From a page, each with a `number`, counted upwards, that the answer repeats as `answers`:

    {"kind": "edit", "edit": {...}}            an edit of `offboard.authoring.edits`
    {"kind": "type", "revision": 3, "changes": [{"start", "removed", "inserted"}]}     typed text
    {"kind": "undo"}, {"kind": "redo"}, {"kind": "save", "force": false}
    {"kind": "layout", "places": {"red": {"x": 1, "y": 2}, "green": null}, "settled": false}

To a page: `document` with the whole text, `changed` with the changes of it, each made for the text after
those before it, `status`, with the `layout` if only that has changed, `{"warning": words}`, and in an answer
`{"refused": reason, "code"}`.

A page whose connection was lost connects again with the `client` that it has made up. `answered` in
`document` is the number of its last message that was carried out, which it must not send again; `session` is
another one if the program was started anew and knows only what was journalled.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Literal, NotRequired

from pydantic import Field, TypeAdapter
from typing_extensions import TypedDict

from framerunner.editing.documents.open_document import OpenDocument
from offboard.authoring import (
    SPANISH,
    Catalogue,
    Change,
    Edge,
    Finding,
    Node,
    Positions,
    Span,
    StateBox,
    StrictModel,
    as_json,
    catalogue,
    diagram,
    findings_of,
    reported_problems,
)

_Number = Annotated[int, Field(ge=0, le=2**53)]


class _FromPage(StrictModel):
    number: _Number


class TypedChange(StrictModel):
    """Some characters replaced by typed ones; offsets count UTF-16 code units."""

    start: _Number
    removed: _Number
    inserted: Annotated[str, Field(max_length=20_000_000)]  # more than a mission may have is refused later


class EditMessage(_FromPage):
    """An edit of the diagram."""

    kind: Literal["edit"]
    edit: dict[str, Any]


class TypeMessage(_FromPage):
    """Typed text."""

    kind: Literal["type"]
    revision: _Number
    changes: Annotated[tuple[TypedChange, ...], Field(max_length=10_000)]


class StepMessage(_FromPage):
    """One step back, or forward again."""

    kind: Literal["undo", "redo"]


class SaveMessage(_FromPage):
    """Write the file."""

    kind: Literal["save"]
    force: bool = False


class LayoutMessage(_FromPage):
    """Where states are drawn; `settled`: by the page, which is nothing to undo."""

    kind: Literal["layout"]
    places: Annotated[dict[str, StateBox | None], Field(max_length=5000)]
    settled: bool = False


PageMessage = Annotated[
    EditMessage | TypeMessage | StepMessage | SaveMessage | LayoutMessage, Field(discriminator="kind")
]
PAGE_MESSAGE: TypeAdapter[PageMessage] = TypeAdapter(PageMessage)


_Span = tuple[int, int] | None


class DrawnNode(TypedDict):
    """A state of the diagram; see `offboard.authoring.diagram.Node`."""

    id: str
    name: str
    parent: str
    initial: str
    final: bool
    finish: bool
    enter: list[str]
    during: list[str]
    exit: list[str]
    parameters: list[tuple[str, str]]
    template: str
    source: str
    span: _Span
    name_span: NotRequired[_Span]


class DrawnEdge(TypedDict):
    """A transition of the diagram; see `offboard.authoring.diagram.Edge`."""

    id: str
    source: str
    target: str
    missing: bool
    event: Literal["tick", "done", "resume"]
    order: int
    when: str
    actions: list[str]
    source_state: str
    source_index: int
    span: _Span
    when_span: NotRequired[_Span]
    to_span: NotRequired[_Span]


class DrawnDiagram(TypedDict):
    """The chart as it is flown."""

    initial: str
    readable: bool
    nodes: list[DrawnNode]
    edges: list[DrawnEdge]


class ShownFinding(TypedDict):
    """Something wrong with the mission; see `offboard.authoring.findings.Finding`."""

    severity: Literal["error", "warning", "advice"]
    code: str
    message: str
    spanish: NotRequired[str]
    line: int
    span: _Span
    state: str
    event: str | None
    index: int | None
    nodes: list[str]


class Place(TypedDict):
    """Where a state is drawn, pixels of the page."""

    x: float
    y: float


class StatusMessage(TypedDict):
    """What a page shows beside the document; only what is told has changed."""

    kind: Literal["status"]
    saved: NotRequired[bool]
    can_undo: NotRequired[bool]
    can_redo: NotRequired[bool]
    others: NotRequired[int]
    layout: NotRequired[dict[str, Place]]
    warning: NotRequired[str]
    answers: NotRequired[int]
    refused: NotRequired[str]
    code: NotRequired[str]


class _Document(TypedDict):
    saved: bool
    can_undo: bool
    can_redo: bool
    name: str
    revision: int
    session: str
    restored: bool
    problem: str
    diagram: DrawnDiagram
    mission: dict[str, str]
    variables: dict[str, str]
    templates: list[str]
    findings: list[ShownFinding]
    layout: dict[str, Place]
    catalogue: NotRequired[Catalogue]
    answers: NotRequired[int]
    refused: NotRequired[str]
    code: NotRequired[str]
    warning: NotRequired[str]
    others: NotRequired[int]


class DocumentMessage(_Document):
    """The whole document; `answered`: number of the page's last message that was carried out."""

    kind: Literal["document"]
    text: str
    answered: NotRequired[int]
    changes: NotRequired[list[TypedChange]]


class ChangedMessage(_Document):
    """The document after changes of its text, each made for the text after those before it."""

    kind: Literal["changed"]
    changes: list[TypedChange]
    text: NotRequired[str]
    answered: NotRequired[int]


ToPage = DocumentMessage | ChangedMessage | StatusMessage


def document_message(opened: OpenDocument) -> dict[str, object]:
    """The whole document."""
    return {**_state(opened), "kind": "document", "text": opened.document.text}


def changed_message(opened: OpenDocument, before: str, changes: Sequence[Change]) -> dict[str, object]:
    """The document after changes of a text."""
    written = []
    for change in changes:
        start = Positions(before).to_utf16(change.start)
        removed = len(change.removed.encode("utf-16-le")) // 2
        written.append({"start": start, "removed": removed, "inserted": change.inserted})
        before = before[: change.start] + change.inserted + before[change.start + len(change.removed) :]
    return {**_state(opened), "kind": "changed", "changes": written}


def status_message(opened: OpenDocument) -> dict[str, object]:
    """What a page shows beside the document."""
    return {
        "kind": "status",
        "saved": opened.is_saved,
        "can_undo": opened.session.can_undo,
        "can_redo": opened.session.can_redo,
    }


def places_message(opened: OpenDocument) -> dict[str, object]:
    """Where the states are drawn."""
    return {name: {"x": box.x, "y": box.y} for name, box in opened.layout.states.items()}


def _fields(each: Node | Edge | Finding) -> dict[str, object]:
    """As `dataclasses.asdict`, which copies all texts and takes a quarter of the answer's time."""
    return {name: getattr(each, name) for name in each.__slots__}


def _state(opened: OpenDocument) -> dict[str, object]:
    document = opened.document
    positions = document.positions

    def at(span: Span | None) -> list[int] | None:
        if span is None:
            return None
        return [positions.to_utf16(each) for each in (span.start, span.end)]

    drawn = diagram(document)
    problems = reported_problems(document, opened.pilot_class)
    findings = findings_of(document, problems)
    found = [{**_fields(each), "span": at(Span(each.start, each.end))} for each in findings]
    if opened.speaks_spanish:
        for shown, problem in zip(found, problems, strict=True):
            shown["spanish"] = problem.message.text(SPANISH)
    nodes = [
        {**_fields(node), "span": at(node.span), "name_span": at(node.name_span)} for node in drawn.nodes
    ]
    edges = [
        {**_fields(edge), "span": at(edge.span), "when_span": at(edge.when_span), "to_span": at(edge.to_span)}
        for edge in drawn.edges
    ]
    outline = document.outline
    keys = ("name", "description", "class", "vision", "detector", "extends", "initial")
    return {
        **status_message(opened),
        "name": opened.path.name,
        "revision": opened.revision,
        "session": opened.name,
        "restored": opened.restored,
        "problem": opened.problem,
        "diagram": {"initial": drawn.initial, "readable": drawn.readable, "nodes": nodes, "edges": edges},
        "mission": {key: outline.text(key) for key in keys},
        "variables": {name: value.text for name, value in outline.variables.items()},
        "templates": [state.name for state in outline.templates],
        "findings": found,
        "layout": places_message(opened),
    }


def catalogue_message(opened: OpenDocument) -> dict[str, object]:
    """The names that the mission can use."""
    outline = opened.document.outline
    variables = dict.fromkeys(outline.variables, 0.0)
    contest = outline.text("class") != "open"
    return as_json(catalogue(opened.pilot_class, variables, contest=contest))
