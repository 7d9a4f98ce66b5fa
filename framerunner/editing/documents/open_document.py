"""A mission file that is being edited: its document, its layout, and a journal of what is not saved yet."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from secrets import token_urlsafe

from framerunner.editing.words import Said, SaidError
from framerunner.errors import UserError, is_disk_full
from framerunner.files.text_file import read_in_folder, replace_file, resolved_in_folder
from offboard.authoring import (
    DiagramLayout,
    Document,
    Edit,
    EditSession,
    LayoutError,
    ReplaceText,
    StateBox,
    TextChange,
    known_places,
    layout_path,
    read_layout,
    write_layout,
)
from offboard.mission import MAX_FILE_BYTES, read_package_base
from offboard.pilot import Pilot

_JOURNAL_SUFFIX = ".unsaved"


class SaveRefusedError(SaidError):
    """The file was not saved."""


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
        pilot_class: whose names the mission uses.
        name: of this opening; after the program was started again it is another.
    """

    path: Path
    session: EditSession
    revision: int = 0
    restored: bool = False
    problem: str = ""
    speaks_spanish: bool = False
    pilot_class: type[Pilot] = Pilot
    name: str = field(default_factory=lambda: token_urlsafe(9))
    _saved: bytes = b""
    _is_kept: bool = True  # the journal has the present text
    _typed: _Typed | None = None  # the last edit, if it was typed letters
    _journal_fails: bool = False

    @classmethod
    def open(cls, path: Path, pilot_class: type[Pilot] = Pilot) -> OpenDocument:
        """Open a file. Raises `MissionError` or `SaidError` if it cannot be read."""
        try:
            document = Document.from_bytes(read_in_folder(path, MAX_FILE_BYTES), path)
        except OSError as error:
            raise SaidError("session.not_read", name=path.name, reason=_words(error)) from None
        try:
            layout, problem = read_layout(path), ""
        except LayoutError as error:
            layout, problem = DiagramLayout(), str(error)
        session = EditSession(document, layout)
        opened = cls(path, session, problem=problem, pilot_class=pilot_class, _saved=document.data)
        opened._restore()
        return opened

    def _restore(self) -> None:
        try:
            kept = read_in_folder(self.journal, MAX_FILE_BYTES)
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
    def layout(self) -> DiagramLayout:
        """Where its states are drawn."""
        return self.session.layout

    def extend_package_only(self) -> None:
        """From now on it extends missions of the package only: other files of the folder are others'."""
        self.session.document = replace(self.document, open_base=read_package_base)

    @property
    def is_saved(self) -> bool:
        """Whether the file has the document's text."""
        return self.document.data == self._saved

    @property
    def journal(self) -> Path:
        """The file beside the mission that has what is not saved."""
        return self.path.with_name(f".{self.path.name}{_JOURNAL_SUFFIX}")

    def apply(self, edit: Edit) -> tuple[TextChange, ...]:
        """Apply an edit of the diagram; see `EditSession.apply`."""
        return self._changed(self.session.apply(edit))

    def type(self, typed: Sequence[tuple[int, int, str]]) -> tuple[TextChange, ...]:
        """Apply typed changes; see `EditSession.type`.

        Letters typed one after the other are undone together, a line at most; deleted ones likewise.
        """
        before, letters = self._typed, None

        def goes_on(change: TextChange) -> bool:
            nonlocal letters
            letters = _letters(change)
            return letters is not None and before is not None and letters.follows(before)

        changes = self._changed(self.session.type(typed, goes_on))
        self._typed = letters
        return changes

    def undo(self) -> tuple[TextChange, ...]:
        """Take the last edit or move of boxes back; see `EditSession.undo`."""
        return self._stepped(self.session.undo)

    def redo(self) -> tuple[TextChange, ...]:
        """Do again what was undone last; see `EditSession.redo`."""
        return self._stepped(self.session.redo)

    def _stepped(self, step: Callable[[], tuple[TextChange, ...]]) -> tuple[TextChange, ...]:
        before = self.layout
        changes = self._changed(step())
        self._typed = None
        if self.layout != before:
            self._write_layout()
        return changes

    def _changed(self, changes: tuple[TextChange, ...]) -> tuple[TextChange, ...]:
        if changes:
            self.revision += 1
            self._typed = None
            self._is_kept = False
        return changes

    def place(self, places: dict[str, StateBox | None], *, settled: bool = False) -> None:
        """Keep where states are drawn, by their full ids; None forgets one.

        Args:
            places: of some states.
            settled: by the page, of states that nobody placed: nothing to undo.

        Raises:
            SaidError: the file of places cannot be written.
        """
        if settled:
            self.session.settle(places)
        else:
            self.session.place(places)
            self._typed = None
        self._write_layout()

    def _write_layout(self) -> None:
        try:
            write_layout(self.path, known_places(self.layout, self.document))
        except LayoutError as error:
            raise SaidError("places.not_written", reason=error) from None

    def is_outdated(self) -> bool:
        """Whether the file has another text, and nothing here is to be saved."""
        try:
            return self.is_saved and read_in_folder(self.path, MAX_FILE_BYTES) != self._saved
        except OSError:
            return False

    def keep(self) -> Said | None:
        """Write the journal, if the text has changed since.

        A disk that refuses it is no reason to stop: it is tried again at the next call.

        Returns:
            What to tell the person, once for each time that writing begins to fail; None if it is written.
        """
        if self._is_kept:
            return None
        try:
            if self.is_saved:
                self.journal.unlink(missing_ok=True)
            else:
                replace_file(resolved_in_folder(self.journal), self.document.data)
        except OSError as error:
            known, self._journal_fails = self._journal_fails, True
            return None if known else Said("journal.not_written", reason=_words(error))
        self._is_kept, self._journal_fails = True, False
        return None

    def save(self, *, force: bool = False) -> Said | None:
        """Write the file.

        Args:
            force: also if another program has changed it meanwhile.

        Returns:
            What else to tell the person; None: nothing.

        Raises:
            SaveRefusedError: it cannot be written, or another program has changed it.
        """
        name = self.path.name
        try:
            file = resolved_in_folder(self.path)  # a link stays one
            if not force and file.exists() and read_in_folder(file, MAX_FILE_BYTES) != self._saved:
                raise SaveRefusedError("session.changed", name=name)
            replace_file(file, self.document.data)
        except OSError as error:
            raise SaveRefusedError("session.not_written", name=name, **write_problem(error)) from None
        self._saved = self.document.data
        self._is_kept = True
        with contextlib.suppress(OSError):
            self.journal.unlink(missing_ok=True)
        try:
            if layout_path(self.path).exists() or self.layout.states:
                self._write_layout()
        except SaidError as error:
            return error.message
        return None


def write_problem(error: OSError) -> dict[str, object]:
    """Reason and advice of a file that cannot be written, for `session.not_written`."""
    advice = "advice.space" if is_disk_full(error) else "advice.again"
    return {"reason": _words(error), "advice": Said(advice)}


def _words(error: OSError) -> str:
    return (error.strerror or str(error)).lower()


def _letters(change: TextChange) -> _Typed | None:
    """What was typed: letters of one line, added or deleted; None if it was more."""
    if bool(change.removed) == bool(change.inserted) or "\n" in change.removed + change.inserted:
        return None
    end, cursor = change.start + len(change.removed), change.start + len(change.inserted)
    return _Typed(change.start, end, cursor, is_deletion=not change.inserted)
