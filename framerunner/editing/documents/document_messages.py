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
from dataclasses import replace
from typing import Annotated, Any, Literal, NotRequired

from pydantic import Field, TypeAdapter
from typing_extensions import TypedDict

from framerunner.editing.documents.open_document import OpenDocument
from offboard.authoring import (
    Catalogue,
    Diagram,
    Finding,
    Positions,
    Span,
    StateBox,
    StrictModel,
    TextChange,
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


class Place(TypedDict):
    """Where a state is drawn, pixels of the page."""

    x: float
    y: float


class _Message(TypedDict, total=False):
    """What each message may have: how many others look, a warning, and which request it answers, and how."""

    others: int
    warning: str
    answers: int
    refused: str
    code: str


class StatusMessage(_Message):
    """What a page shows beside the document; only what is told has changed."""

    kind: Literal["status"]
    saved: NotRequired[bool]
    can_undo: NotRequired[bool]
    can_redo: NotRequired[bool]
    layout: NotRequired[dict[str, Place]]


class _Document(_Message):
    saved: bool
    can_undo: bool
    can_redo: bool
    name: str
    revision: int
    session: str
    restored: bool
    problem: str
    diagram: Diagram
    mission: dict[str, str]
    variables: dict[str, str]
    templates: list[str]
    findings: list[Finding]
    spanish: NotRequired[list[str]]
    layout: dict[str, Place]
    catalogue: NotRequired[Catalogue]
    answered: NotRequired[int]


class DocumentMessage(_Document):
    """The whole document; `answered`: number of the page's last message that was carried out."""

    kind: Literal["document"]
    text: str
    changes: NotRequired[list[TypedChange]]


class ChangedMessage(_Document):
    """The document after changes of its text, each made for the text after those before it."""

    kind: Literal["changed"]
    changes: list[TypedChange]
    text: NotRequired[str]


ToPage = DocumentMessage | ChangedMessage | StatusMessage


def document_message(opened: OpenDocument) -> dict[str, object]:
    """The whole document."""
    return {**_state(opened), "kind": "document", "text": opened.document.text}


def changed_message(opened: OpenDocument, before: str, changes: Sequence[TextChange]) -> dict[str, object]:
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


def _state(opened: OpenDocument) -> dict[str, object]:
    document = opened.document
    positions = document.positions

    def at(span: Span | None) -> Span | None:
        return span and Span(positions.to_utf16(span.start), positions.to_utf16(span.end))

    drawn = diagram(document)
    nodes = (replace(each, span=at(each.span), name_span=at(each.name_span)) for each in drawn.nodes)
    edges = (
        replace(each, span=at(each.span), when_span=at(each.when_span), to_span=at(each.to_span))
        for each in drawn.edges
    )
    problems = reported_problems(document, opened.pilot_class)
    findings = findings_of(document, problems)
    outline = document.outline
    keys = ("name", "description", "class", "vision", "detector", "extends", "initial")
    state = {
        **status_message(opened),
        "name": opened.path.name,
        "revision": opened.revision,
        "session": opened.name,
        "restored": opened.restored,
        "problem": opened.problem,
        "diagram": replace(drawn, nodes=tuple(nodes), edges=tuple(edges)),
        "mission": {key: outline.text(key) for key in keys},
        "variables": {name: value.text for name, value in outline.variables.items()},
        "templates": [state.name for state in outline.templates],
        "findings": [
            replace(each, start=positions.to_utf16(each.start), end=positions.to_utf16(each.end))
            for each in findings
        ],
        "layout": places_message(opened),
    }
    if opened.speaks_spanish:
        state["spanish"] = [each.message.text("es") for each in problems]
    return state


def catalogue_message(opened: OpenDocument) -> Catalogue:
    """The names that the mission can use."""
    outline = opened.document.outline
    variables = dict.fromkeys(outline.variables, 0.0)
    contest = outline.text("class") != "open"
    return catalogue(opened.pilot_class, variables, contest=contest)
