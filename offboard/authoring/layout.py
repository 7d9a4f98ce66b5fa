"""Where a page has put the states of a diagram: a side file `NAME.layout.json` next to the mission.

The mission itself has no positions. A state without a place in the file is placed by the page.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, ValidationError

from framerunner.errors import UserError
from framerunner.files.text_file import TextError, decode_text, read_in_folder, replace_file
from offboard.authoring.document import Document
from offboard.authoring.edits import DeleteState, Edit, MoveState, RenameState, StrictModel
from offboard.authoring.references import beside, chart_ids, instances, prefix_change

_MAX_BYTES = 1_000_000
_ADVICE = "correct it, or delete the file and the states are placed anew"
Coordinate = Annotated[float, Field(ge=-1e6, le=1e6, allow_inf_nan=False)]
Size = Annotated[float, Field(gt=0, le=1e6, allow_inf_nan=False)]


class LayoutError(UserError):
    """A layout file cannot be used; the message is one line."""


class StateBox(StrictModel):
    """Where a state is drawn, in pixels of the page; with a width and height of its own if they were set."""

    x: Coordinate
    y: Coordinate
    width: Size | None = None
    height: Size | None = None


class DiagramLayout(StrictModel):
    """Places by full id of the state, and the corners of edges by the edge's id."""

    version: Literal[1] = 1
    states: dict[str, StateBox] = Field(default_factory=dict, max_length=5000)
    corners: dict[str, tuple[tuple[Coordinate, Coordinate], ...]] = Field(
        default_factory=dict, max_length=20_000
    )


def layout_path(mission: str | Path) -> Path:
    """The side file of a mission file."""
    return Path(mission).with_suffix(".layout.json")


def parse_layout(text: str, name: str = "layout") -> DiagramLayout:
    """A layout from its file's content. Raises `LayoutError`."""
    try:
        return DiagramLayout.model_validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in first["loc"]) or "file"
        raise LayoutError(f"{name}: {where}: {first['msg'][:200]}; {_ADVICE}") from None


def read_layout(mission: str | Path) -> DiagramLayout:
    """The layout of a mission file; an empty one if it has none. Raises `LayoutError`."""
    path = layout_path(mission)
    try:
        data = read_in_folder(path, _MAX_BYTES)
        text = decode_text(data)
    except FileNotFoundError:
        return DiagramLayout()
    except OSError as error:
        raise LayoutError(f"{path.name}: cannot be read: {error.strerror}; {_ADVICE}") from None
    except TextError as error:
        raise LayoutError(f"{path.name}: {error}; {_ADVICE}") from None
    if len(data) > _MAX_BYTES:
        raise LayoutError(f"{path.name}: is larger than {_MAX_BYTES / 1e6:g} MB; {_ADVICE}")
    return parse_layout(text, path.name)


def layout_text(layout: DiagramLayout) -> str:
    """The content of a layout's file: one state a line, in order of their ids, so that a diff is small."""
    data = layout.model_dump(mode="json", exclude_none=True)
    parts = []
    for key in ("states", "corners"):
        lines = [f"    {json.dumps(name)}: {json.dumps(data[key][name])}" for name in sorted(data[key])]
        parts.append(f'  "{key}": {{' + ("\n" + ",\n".join(lines) + "\n  }" if lines else "}"))
    return '{\n  "version": 1,\n' + ",\n".join(parts) + "\n}\n"


def write_layout(mission: str | Path, layout: DiagramLayout) -> Path:
    """Write the side file of a mission file.

    Raises:
        LayoutError: it cannot be written, or what is there is not understood, which is left as it is.
    """
    path = layout_path(mission)
    read_layout(mission)
    try:
        replace_file(path, layout_text(layout))
    except OSError as error:
        raise LayoutError(f"{path.name}: cannot be written: {error.strerror}") from None
    return path


def follow(layout: DiagramLayout, before: Document, edit: Edit, after: Document) -> DiagramLayout:
    """The layout after an edit: states that were renamed or moved keep their places, deleted ones lose them.

    After typed text nothing is known of what became of a state, so all places are kept.
    """
    if not isinstance(edit, (RenameState, MoveState, DeleteState)):
        return layout
    state = before.outline.get(edit.state)
    if state is None:
        return layout
    pairs = []
    if isinstance(edit, RenameState) and not state.is_template:
        pairs = [(i, beside(i, edit.name)) for i in instances(before, state)]
    elif isinstance(edit, MoveState):
        prefix = f"{edit.parent}." if edit.parent else ""
        moved = after.outline.get(prefix + state.name)
        new = () if moved is None else instances(after, moved)
        pairs = list(zip(instances(before, state), new, strict=False))
    change = prefix_change(pairs)
    known = chart_ids(after)
    return DiagramLayout(
        states={change(name): box for name, box in layout.states.items() if change(name) in known},
        corners={_edge_id(name, change): points for name, points in layout.corners.items()},
    )


def with_places(layout: DiagramLayout, places: Mapping[str, StateBox | None]) -> DiagramLayout:
    """A layout with other places of some states; None forgets one."""
    states = {**layout.states, **{name: box for name, box in places.items() if box is not None}}
    for name, box in places.items():
        if box is None:
            states.pop(name, None)
    return DiagramLayout(states=states, corners=layout.corners)


def known_places(layout: DiagramLayout, document: Document) -> DiagramLayout:
    """The places of the states that a document has; all, if it cannot be understood."""
    return layout if document.chart is None else completed(layout, DiagramLayout(), document)


def completed(layout: DiagramLayout, earlier: DiagramLayout, document: Document) -> DiagramLayout:
    """The layout of a document's states; those that have no place have the one of an earlier layout."""
    if document.chart is None:
        return layout
    known = chart_ids(document)
    states = {name: box for name, box in (earlier.states | layout.states).items() if name in known}
    edges = earlier.corners | layout.corners
    return DiagramLayout(
        states=states,
        corners={name: points for name, points in edges.items() if name.partition("/")[0] in known},
    )


def _edge_id(name: str, change: object) -> str:
    assert callable(change)
    state, _, rest = name.partition("/")
    return f"{change(state)}/{rest}"
