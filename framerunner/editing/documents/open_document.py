"""A mission file that is being edited: its document, its layout, and a journal of what is not saved yet."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from errors import UserError
from offboard.authoring import (
    Change,
    Document,
    Edit,
    EditSession,
    Layout,
    LayoutError,
    ReplaceText,
    StateBox,
    known_places,
    layout_path,
    read_layout,
    write_layout,
)

_JOURNAL_SUFFIX = ".unsaved"


class SaveRefusedError(UserError):
    """The file was not saved; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class _Typed:
    """Letters that were typed or deleted.

    Attributes:
        start, end: offsets of what was replaced, before that.
        cursor: where it was afterwards.
    """

    start: int
    end: int
    cursor: int
    is_deletion: bool

    def follows(self, before: _Typed) -> bool:
        """Whether the same was done before, next to this."""
        if self.is_deletion != before.is_deletion:
            return False
        # Letters are added and deleted forwards from the cursor, and deleted backwards towards it.
        return self.start == before.cursor or (self.is_deletion and self.end == before.cursor)


@dataclass(slots=True)
class OpenDocument:
    """A mission file in the editor.

    Attributes:
        path: of the file.
        session: the document with its edits.
        revision: counts the document's changes.
        restored: what a killed program had not saved was found and is shown.
        speaks_spanish: a page wants findings in Spanish, too.
        problem: what else went wrong at opening, in one line; empty: nothing.
    """

    path: Path
    session: EditSession
    revision: int = 0
    restored: bool = False
    problem: str = ""
    speaks_spanish: bool = False
    _saved: bytes = b""
    _is_kept: bool = True  # the journal has the present text
    _typed: _Typed | None = None  # the last edit, if it was typed letters

    @classmethod
    def open(cls, path: Path) -> OpenDocument:
        """Open a file. Raises `MissionError` if it cannot be read."""
        document = Document.open(path)
        try:
            layout, problem = read_layout(path), ""
        except LayoutError as error:
            layout, problem = Layout(), str(error)
        opened = cls(path, EditSession(document, layout), problem=problem, _saved=document.data)
        opened._restore()
        return opened

    def _restore(self) -> None:
        try:
            kept = self.journal.read_bytes()
            text = Document.from_bytes(kept, self.path).text
        except (OSError, UserError):
            return
        if kept != self._saved:
            end = len(self.session.document.text)
            self.session.apply(ReplaceText(start=0, end=end, text=text))
            self.restored = True

    @property
    def document(self) -> Document:
        """As it is now."""
        return self.session.document

    @property
    def layout(self) -> Layout:
        """Where its states are drawn."""
        return self.session.layout

    @property
    def is_saved(self) -> bool:
        """Whether the file has the document's text."""
        return self.document.data == self._saved

    @property
    def journal(self) -> Path:
        """The file beside the mission that has what is not saved."""
        return self.path.with_name(f".{self.path.name}{_JOURNAL_SUFFIX}")

    def apply(self, edit: Edit) -> tuple[Change, ...]:
        """Apply an edit; see `EditSession.apply`.

        Letters typed one after the other are undone together, a line at most; deleted ones likewise.
        """
        typed = _typed(self.document.text, edit) if isinstance(edit, ReplaceText) else None
        goes_on = typed is not None and self._typed is not None and typed.follows(self._typed)
        changes = self._changed(self.session.apply(edit, goes_on=goes_on))
        self._typed = typed
        return changes

    def take_back(self, changes: Sequence[Change]) -> None:
        """Make the text as it was before its last changes."""
        for change in reversed(changes):
            inverse = change.inverse
            self.apply(
                ReplaceText(
                    start=inverse.start, end=inverse.start + len(inverse.removed), text=inverse.inserted
                )
            )

    def undo(self) -> tuple[Change, ...]:
        """Take the last edit or move of boxes back; see `EditSession.undo`."""
        return self._stepped(self.session.undo)

    def redo(self) -> tuple[Change, ...]:
        """Do again what was undone last; see `EditSession.redo`."""
        return self._stepped(self.session.redo)

    def _stepped(self, step: Callable[[], tuple[Change, ...]]) -> tuple[Change, ...]:
        before = self.layout
        changes = self._changed(step())
        self._typed = None
        if self.layout != before:
            self._write_layout()
        return changes

    def _changed(self, changes: tuple[Change, ...]) -> tuple[Change, ...]:
        if changes:
            self.revision += 1
            self._typed = None
            self._is_kept = False
        return changes

    def place(self, places: dict[str, StateBox | None], *, settled: bool = False) -> None:
        """Keep where states are drawn, by their full ids; None forgets one. Raises `LayoutError`.

        Args:
            places: of some states.
            settled: by the page, of states that nobody placed: nothing to undo.
        """
        if settled:
            self.session.settle(places)
        else:
            self.session.place(places)
            self._typed = None
        self._write_layout()

    def _write_layout(self) -> None:
        write_layout(self.path, known_places(self.layout, self.document))

    def keep(self) -> None:
        """Write the journal, if the text has changed since; a disk that refuses it is no reason to stop."""
        if self._is_kept:
            return
        self._is_kept = True
        if self.is_saved:
            self.journal.unlink(missing_ok=True)
            return
        part = self.journal.with_suffix(".part")
        try:
            part.write_bytes(self.document.data)
            os.replace(part, self.journal)
        except OSError:
            part.unlink(missing_ok=True)

    def save(self, *, force: bool = False) -> None:
        """Write the file.

        Args:
            force: also if another program has changed it meanwhile.

        Raises:
            SaveRefusedError: it cannot be written, or another program has changed it.
        """
        name = self.path.name
        file = Path(os.path.realpath(self.path))  # a link stays one
        part = file.with_name(f".{file.name}.part")
        try:
            if not force and file.exists() and file.read_bytes() != self._saved:
                raise SaveRefusedError(f"{name} was changed by another program since it was opened")
            part.write_bytes(self.document.data)
            if file.exists():
                part.chmod(file.stat().st_mode & 0o777)
            os.replace(part, file)
            if layout_path(self.path).exists() or self.layout.states:
                self._write_layout()
        except OSError as error:
            part.unlink(missing_ok=True)
            raise SaveRefusedError(f"{name}: cannot be written ({error.strerror})") from None
        self._saved = self.document.data
        self._is_kept = True
        self.journal.unlink(missing_ok=True)


def _typed(text: str, edit: ReplaceText) -> _Typed | None:
    """What was typed with an edit of a text: letters of one line, added or deleted; None if it was more."""
    is_addition, is_deletion = edit.start == edit.end, edit.text == ""
    if is_addition == is_deletion or "\n" in edit.text or "\n" in text[edit.start : edit.end]:
        return None
    return _Typed(edit.start, edit.end, edit.start + len(edit.text), is_deletion)
