"""Missions as an editor needs them: documents, edits, findings, a catalogue, a diagram, and exchange.

Everything here is pure: it reads files where that is said, and uses no clock, socket or task. A page or
another program uses the names of this package only:

    session = EditSession(Document.open("my_mission.yaml"))
    session.apply(parse_edit({"kind": "rename_state", "state": "red", "name": "first"}))
    session.document.text, check_document(session.document), diagram(session.document)
    session.undo()
    Path("my_mission.yaml").write_bytes(session.document.data)

**Document** (immutable): `open(path)`, `from_bytes`, `from_text`; `text` (lines end with a line feed),
`data` (the file's bytes, with its own line ends), `path`, `unreadable` (why it is not YAML, or None),
`outline`, `chart`, `positions`. Any text is a document. Offsets count characters of `text`; lines and
columns count from 1. JavaScript counts UTF-16 units: `positions.to_utf16(offset)`
converts, which matters only for characters beyond U+FFFF.

**Paths.** Edits name a state by where it is written: `red`, `landing.stop`, and `@cross_frame.turning`
for the state of a template (`@cross_frame` is the template). The diagram names states by the full id
that the engine reports, `red.turning`; each node's `source` is its path, empty if it is written in
another file (`extends`).

**Edits**: pydantic models in `offboard.authoring.edits`; `parse_edit(data)` makes one of what JSON
holds, `edit_schema()` is their JSON Schema. `kind` is one of

    add_state {name, parent?, index?, final?, use?, states?}    add_template {name, states}
    rename_state {state, name}                                  move_state {state, parent, index?}
    duplicate_state {state, name, parameters?: {name: value}}   delete_state {state, references?}
    add_transition {state, to, when?, actions?, event?, index?} delete_transition {transition}
    redirect_transition {transition, to}                        set_source {transition, state, to}
    move_transition {transition, index}
    set_guard {transition, when}                                set_event {transition, event}
    set_transition_actions {transition, actions}                set_actions {state, section, actions}
    set_initial {state?, name}                                  set_final {state, final}
    set_use {state, template}                                   set_parameter {state, name, value}
    set_variable {name, value | null}                           set_mission {key, value}
    replace_text {start, end, text}

with `transition` = {state, event?: tick | done | resume, index?}, `section` = enter | during | exit and
`references` = keep | delete. The event `tick` is
an entry of `transitions`, `done` is `then`, `resume` is `resume`. `to` is a path or a full id.

`apply(document, edit)` returns `Edited(document, changes)`; `EditSession(document, layout)` does so with
`undo()`, `redo()` and a `layout` that follows; `place(places)` moves states and is undone likewise. A
`TextChange` is {start, removed, inserted}; the changes of one edit follow each other, each made for the text
after those before it. What cannot be applied raises `EditError` with one line, and nothing is changed; its
`message.text("es")` says it in Spanish.

**Findings**: `check_document(document, pilot_class)` returns `Finding`s: severity (error | warning |
advice), code, message, file, line, column, start, end, state, event, index, section, nodes.
`problems_of` has them before they are put into words. `check_document(document, language="es")` says them
in Spanish; for several languages, `findings_of(document, reported_problems(document))` checks once.

**Catalogue**: `catalogue_of(document, pilot_class)`: `values` (name, type, text, unit, low,
high, choices, assignable, needs_map, own) and `primitives` (name, text, help, needs_map, own).

**Diagram**: `diagram(document)`: `nodes` and `edges` with ids, places in the text and what edits need,
`settings`, `variables`, `templates`.

**Layout**: `read_layout`, `write_layout`, `parse_layout`, `follow` after an edit; the side file
`NAME.layout.json` is {version: 1, states: {id: {x, y, width?, height?}}, corners: {edge id: [[x, y],
...]}}.

**Exchange**: `export_scxml(chart)`, `import_scxml(data, name)` (raises `XmlError`), `mermaid_of(chart,
active)`; a `chart` is `Document.chart` or `Mission.spec`.

`as_json(value)` turns findings, catalogues, diagrams and changes into what `json.dumps` takes.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from offboard.authoring.apply import Edited, EditSession, apply
from offboard.authoring.catalogue import Catalogue, PrimitiveEntry, ValueEntry, catalogue, catalogue_of
from offboard.authoring.diagram import Diagram, Edge, Node, diagram
from offboard.authoring.document import Document
from offboard.authoring.edit_texts import EditError
from offboard.authoring.edits import Edit, ReplaceText, StrictModel, TransitionPath, edit_schema, parse_edit
from offboard.authoring.findings import (
    Finding,
    check_document,
    findings_of,
    problems_of,
    reported_problems,
)
from offboard.authoring.layout import (
    DiagramLayout,
    LayoutError,
    StateBox,
    follow,
    known_places,
    layout_path,
    parse_layout,
    read_layout,
    write_layout,
)
from offboard.authoring.outline import Span
from offboard.authoring.scxml_export import export_scxml
from offboard.authoring.scxml_import import import_scxml
from offboard.authoring.text import Positions, TextChange
from offboard.authoring.xml_tree import XmlError
from offboard.mission import mermaid_of

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

__all__ = [
    "Catalogue",
    "Diagram",
    "DiagramLayout",
    "Document",
    "Edge",
    "Edit",
    "EditError",
    "EditSession",
    "Edited",
    "Finding",
    "LayoutError",
    "Node",
    "Positions",
    "PrimitiveEntry",
    "ReplaceText",
    "Span",
    "StateBox",
    "StrictModel",
    "TextChange",
    "TransitionPath",
    "ValueEntry",
    "XmlError",
    "apply",
    "as_json",
    "catalogue",
    "catalogue_of",
    "check_document",
    "diagram",
    "edit_schema",
    "export_scxml",
    "findings_of",
    "follow",
    "import_scxml",
    "known_places",
    "layout_path",
    "mermaid_of",
    "parse_edit",
    "parse_layout",
    "problems_of",
    "read_layout",
    "reported_problems",
    "write_layout",
]


def as_json(value: DataclassInstance) -> dict[str, Any]:
    """A finding, catalogue, diagram or change as dictionaries and lists of JSON's types."""
    return asdict(value)
