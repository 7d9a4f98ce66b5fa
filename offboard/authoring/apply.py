"""Applies edits to documents, and takes them back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from offboard.authoring import edits, state_edits, transition_edits
from offboard.authoring.document import Document
from offboard.authoring.layout import Layout, StateBox, completed, follow, with_places
from offboard.authoring.messages import EditError
from offboard.authoring.text import Change
from offboard.authoring.work import Work
from offboard.mission import MAX_FILE_BYTES

_STEPS: Mapping[type, Callable[[Work, Any], None]] = {
    edits.AddState: state_edits.add_state,
    edits.AddTemplate: state_edits.add_template,
    edits.RenameState: state_edits.rename_state,
    edits.MoveState: state_edits.move_state,
    edits.DuplicateState: state_edits.duplicate_state,
    edits.DeleteState: state_edits.delete_state,
    edits.SetActions: state_edits.set_actions,
    edits.SetInitial: state_edits.set_initial,
    edits.SetFinal: state_edits.set_final,
    edits.SetUse: state_edits.set_use,
    edits.SetParameter: state_edits.set_parameter,
    edits.AddTransition: transition_edits.add_transition,
    edits.DeleteTransition: transition_edits.delete_transition,
    edits.RedirectTransition: transition_edits.redirect_transition,
    edits.SetSource: transition_edits.set_source,
    edits.MoveTransition: transition_edits.move_transition,
    edits.SetGuard: transition_edits.set_guard,
    edits.SetEvent: transition_edits.set_event,
    edits.SetTransitionActions: transition_edits.set_transition_actions,
    edits.SetVariable: transition_edits.set_variable,
    edits.SetMission: transition_edits.set_mission,
}


@dataclass(frozen=True, slots=True)
class Edited:
    """A document after an edit.

    Attributes:
        changes: of the text, in order; each is made for the text after those before it.
    """

    document: Document
    changes: tuple[Change, ...]


def apply(document: Document, edit: edits.Edit) -> Edited:
    """Apply an edit. Raises `EditError` if it cannot be applied; the document is never changed."""
    if isinstance(edit, edits.ReplaceText):
        return _replace_text(document, edit)
    work = Work(document)
    _STEPS[type(edit)](work, edit)
    if work.document.unreadable is not None:
        raise EditError("edit.breaks")
    _refuse_too_long(work.document)
    return Edited(work.document, tuple(work.changes))


def _replace_text(document: Document, edit: edits.ReplaceText) -> Edited:
    length = len(document.text)
    if not edit.start <= edit.end <= length:
        raise EditError("edit.range", start=edit.start, end=edit.end, length=length)
    try:
        edit.text.encode("utf-8")
    except UnicodeEncodeError:
        raise EditError("edit.half_pair") from None
    change = document.content.change(edit.start, edit.end, edit.text)
    changed = Document(document.content.changed(change), document.path)
    _refuse_too_long(changed)
    return Edited(changed, (change,) if change.removed != change.inserted else ())


def _refuse_too_long(document: Document) -> None:
    if len(document.data) > MAX_FILE_BYTES:
        raise EditError("edit.too_large")


@dataclass(frozen=True, slots=True)
class _Step:
    """An edit that was done or undone, with the layout before that; a move of boxes has no changes."""

    changes: tuple[Change, ...]
    layout: Layout


class EditSession:
    """A document and the places of its states, with edits that can be undone and done again.

    Args:
        document: as opened.
        layout: where its states are drawn.

    Attributes:
        document: as it is now.
        layout: likewise. Renamed and moved states keep their places; undoing gives all states the places that
            they had before the edit.
    """

    def __init__(self, document: Document, layout: Layout | None = None) -> None:
        self.document = document
        self.layout = Layout() if layout is None else layout
        self._done: list[_Step] = []
        self._undone: list[_Step] = []

    @property
    def can_undo(self) -> bool:
        """Whether there is an edit to take back."""
        return bool(self._done)

    @property
    def can_redo(self) -> bool:
        """Whether there is an edit that was taken back."""
        return bool(self._undone)

    def apply(self, edit: edits.Edit, *, goes_on: bool = False) -> tuple[Change, ...]:
        """Apply an edit and return the changes of the text. Raises `EditError`; nothing is changed then.

        Args:
            edit: what to do.
            goes_on: it is undone together with the edit before, as one letter of a typed word is.
        """
        edited = apply(self.document, edit)
        if edited.changes:
            before = self._done.pop() if goes_on and self._done else _Step((), self.layout)
            self._done.append(_Step((*before.changes, *edited.changes), before.layout))
            self._undone.clear()
            self.layout = follow(self.layout, self.document, edit, edited.document)
            self.document = edited.document
        return edited.changes

    def place(self, places: Mapping[str, StateBox | None]) -> None:
        """Move states in the diagram, by their full ids; None forgets a place. It is undone as edits are."""
        layout = with_places(self.layout, places)
        if layout != self.layout:
            self._done.append(_Step((), self.layout))
            self._undone.clear()
            self.layout = layout

    def settle(self, places: Mapping[str, StateBox | None]) -> None:
        """Note where a page has drawn states that nobody placed; it is no step of its own."""
        self.layout = with_places(self.layout, places)

    def undo(self) -> tuple[Change, ...]:
        """Take the last edit back and return the changes of the text. Raises `EditError` if there is none.

        The last one may have been a move of boxes: then the text has no changes.
        """
        if not self._done:
            raise EditError("edit.no_undo")
        step = self._done.pop()
        self._undone.append(_Step(step.changes, self.layout))
        return self._change(tuple(change.inverse for change in reversed(step.changes)), step.layout)

    def redo(self) -> tuple[Change, ...]:
        """Do again what was undone last. Raises `EditError` if nothing was."""
        if not self._undone:
            raise EditError("edit.no_redo")
        step = self._undone.pop()
        self._done.append(_Step(step.changes, self.layout))
        return self._change(step.changes, step.layout)

    def _change(self, changes: tuple[Change, ...], layout: Layout) -> tuple[Change, ...]:
        content = self.document.content
        for change in changes:
            content = content.changed(change)
        if changes:
            self.document = Document(content, self.document.path)
            layout = completed(layout, self.layout, self.document)
        self.layout = layout
        return changes
