"""Applies edits to documents, and takes them back."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from offboard.authoring import edits, state_edits, transition_edits
from offboard.authoring.document import Document
from offboard.authoring.edit_texts import EditError
from offboard.authoring.layout import DiagramLayout, StateBox, completed, follow, with_places
from offboard.authoring.text import TextChange
from offboard.authoring.work import Work
from offboard.mission import MAX_FILE_BYTES

_MAX_KEPT = 20_000_000  # characters of edits that can be undone

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
    changes: tuple[TextChange, ...]


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
    return _changed(document, document.content.changes([(edit.start, edit.end, edit.text)])[0])


def _typed(document: Document, typed: Sequence[tuple[int, int, str]]) -> Edited:
    try:
        change = document.content.typed(typed)
    except IndexError as error:
        raise EditError("edit.beyond", place=error.args[0]) from None
    except UnicodeError:
        raise EditError("edit.half_pair") from None
    return _changed(document, change)


def _changed(document: Document, change: TextChange) -> Edited:
    changed = replace(document, content=document.content.changed(change))
    _refuse_too_long(changed)
    return Edited(changed, (change,) if change.removed != change.inserted else ())


def _refuse_too_long(document: Document) -> None:
    if len(document.data) > MAX_FILE_BYTES:
        raise EditError("edit.too_large")


@dataclass(frozen=True, slots=True)
class _Step:
    """An edit that was done or undone, with the layout before that; a move of boxes has no changes."""

    changes: tuple[TextChange, ...]
    layout: DiagramLayout

    @property
    def size(self) -> int:
        """Characters that it keeps."""
        return sum(len(each.removed) + len(each.inserted) for each in self.changes)


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

    def __init__(self, document: Document, layout: DiagramLayout | None = None) -> None:
        self.document = document
        self.layout = DiagramLayout() if layout is None else layout
        self._done: deque[_Step] = deque()
        self._undone: list[_Step] = []
        self._kept = 0  # characters in the steps that can be undone

    @property
    def can_undo(self) -> bool:
        """Whether there is an edit to take back."""
        return bool(self._done)

    @property
    def can_redo(self) -> bool:
        """Whether there is an edit that was taken back."""
        return bool(self._undone)

    def apply(self, edit: edits.Edit) -> tuple[TextChange, ...]:
        """Apply an edit and return the changes of the text. Raises `EditError`; nothing is changed then."""
        edited = apply(self.document, edit)
        if edited.changes:
            layout = follow(self.layout, self.document, edit, edited.document)
            self._do(_Step(edited.changes, self.layout), edited.document, layout)
        return edited.changes

    def type(
        self, typed: Sequence[tuple[int, int, str]], goes_on: Callable[[TextChange], bool] = lambda _: False
    ) -> tuple[TextChange, ...]:
        """Apply typed changes, see `MissionText.typed`, as one. Raises `EditError`; nothing is changed then.

        Args:
            typed: what was typed.
            goes_on: whether the change is letters beside those of the step before, with which it is undone.
        """
        edited = _typed(self.document, typed)
        if edited.changes:
            (change,) = edited.changes
            step = _Step((change,), self.layout)
            if goes_on(change) and self._done:
                before = self._done.pop()
                self._kept -= before.size
                step = _Step((before.changes[0].with_letters(change),), before.layout)
            self._do(step, edited.document, self.layout)
        return edited.changes

    def _do(self, step: _Step, document: Document, layout: DiagramLayout) -> None:
        self._undone.clear()
        self._remember(step)
        self.document, self.layout = document, layout

    def _remember(self, step: _Step) -> None:
        """Keep a step that can be undone, and forget the oldest ones of a long session."""
        self._done.append(step)
        self._kept += step.size
        while self._kept > _MAX_KEPT and len(self._done) > 1:
            self._kept -= self._done.popleft().size

    def place(self, places: Mapping[str, StateBox | None]) -> None:
        """Move states in the diagram, by their full ids; None forgets a place. It is undone as edits are."""
        layout = with_places(self.layout, places)
        if layout != self.layout:
            self._do(_Step((), self.layout), self.document, layout)

    def settle(self, places: Mapping[str, StateBox | None]) -> None:
        """Note where a page has drawn states that nobody placed; it is no step of its own."""
        self.layout = with_places(self.layout, places)

    def undo(self) -> tuple[TextChange, ...]:
        """Take the last edit back and return the changes of the text. Raises `EditError` if there is none.

        The last one may have been a move of boxes: then the text has no changes.
        """
        if not self._done:
            raise EditError("edit.no_undo")
        step = self._done.pop()
        self._kept -= step.size
        self._undone.append(_Step(step.changes, self.layout))
        return self._change(tuple(change.inverse for change in reversed(step.changes)), step.layout)

    def redo(self) -> tuple[TextChange, ...]:
        """Do again what was undone last. Raises `EditError` if nothing was."""
        if not self._undone:
            raise EditError("edit.no_redo")
        step = self._undone.pop()
        self._remember(_Step(step.changes, self.layout))
        return self._change(step.changes, step.layout)

    def _change(self, changes: tuple[TextChange, ...], layout: DiagramLayout) -> tuple[TextChange, ...]:
        content = self.document.content
        for change in changes:
            content = content.changed(change)
        if changes:
            self.document = replace(self.document, content=content)
            layout = completed(layout, self.layout, self.document)
        self.layout = layout
        return changes
