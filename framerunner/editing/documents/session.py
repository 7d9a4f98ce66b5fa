"""The missions of one folder, opened by pages; pages that show the same file share its document."""

from __future__ import annotations

import asyncio
import contextlib
import re
import time
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol, TypeVar
from weakref import WeakValueDictionary

from framerunner.editing.documents.open_document import OpenDocument, write_problem
from framerunner.editing.words import Said, SaidError
from framerunner.files.text_file import make_file, read_text, resolved_in_folder
from offboard.chart.mission_texts import Language
from offboard.mission import installed_mission, new_mission
from offboard.pilot import Pilot

_FILE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,80}\.ya?ml")
_NAME = re.compile(r"[a-z][a-z0-9_]{0,59}")
_MAX_LISTED = 500
_MAX_OPEN = 50
_MAX_CLIENTS = 200
_THREADS = 4
_LINGERS_S = 120.0  # after the last page has left: it may only have lost its connection

EMPTY_CHART = """\
name: {name}
description: A new mission
initial: start

states:
  start:
"""
T = TypeVar("T")


class SessionError(SaidError):
    """A file that cannot be opened or made."""


class DocumentViewer(Protocol):
    """A page that shows a document; `language` is that of its words."""

    language: Language

    def put(self, line: str) -> None:
        """Queue a message, JSON."""

    def warn(self, what: Said) -> None:
        """Tell the person something."""


@dataclass(slots=True)
class SharedDocument:
    """An open document and the pages that show it.

    Attributes:
        opened: the document; used only with the lock.
        viewers: take each message for all pages.
        lock: held while the document is read or changed, which is done in a thread.
        users: who has it open, viewers included.
        answered: number of the last message that was carried out, by page.
    """

    opened: OpenDocument
    viewers: list[DocumentViewer] = field(default_factory=list)
    lock: asyncio.Lock = field(default_factory=asyncio.Lock)
    users: int = 0
    answered: OrderedDict[str, int] = field(default_factory=OrderedDict)
    _left_s: float = 0.0

    def leave(self) -> None:
        """One user less; it stays open for a while, with its history, for a page that connects again."""
        self.users -= 1
        self._left_s = time.monotonic()

    def lingers(self) -> bool:
        """Whether it is still in use, or may be again."""
        return self.users > 0 or time.monotonic() - self._left_s < _LINGERS_S

    def note(self, client: str, number: int) -> None:
        """A page's message was carried out."""
        if client:
            self.answered[client] = number
            self.answered.move_to_end(client)
            while len(self.answered) > _MAX_CLIENTS:
                self.answered.popitem(last=False)


class EditorSession:
    """Opens and makes missions in a folder. Pages name files, never paths.

    Reading and checking a mission may take a second, so `work` does it in threads, which share the
    interpreter with the server's loop.

    Args:
        folder: with the missions.
        pilot_class: whose names missions use: `Pilot` or a contestant's.
    """

    def __init__(self, folder: Path, pilot_class: type[Pilot] = Pilot) -> None:
        self.folder = folder
        self._pilot_class = pilot_class
        self._open: dict[str, SharedDocument] = {}
        self._opening: WeakValueDictionary[str, asyncio.Lock] = WeakValueDictionary()
        self._threads = ThreadPoolExecutor(_THREADS, "editor")

    async def work(self, what: Callable[[], T]) -> T:
        """Do something in a thread."""
        return await asyncio.get_running_loop().run_in_executor(self._threads, what)

    def files(self) -> list[str]:
        """Names of the YAML files in the folder, sorted."""
        try:
            names = [each.name for each in self.folder.iterdir() if _can_be_opened(each)]
        except OSError:
            return []
        return sorted(name for name in names if _FILE.fullmatch(name))[:_MAX_LISTED]

    async def open(self, name: str, *, package_only: bool = False) -> SharedDocument:
        """A file's document; call its `leave` at the end.

        Args:
            name: of the file.
            package_only: who opens it may not read what other files of the folder say.

        Raises:
            SessionError, MissionError: it cannot be opened.
        """
        if not _FILE.fullmatch(name):
            raise SessionError("session.not_here", name=name[:80])
        # Of this file only: others are not held up.
        async with self._opening.setdefault(name, asyncio.Lock()):
            shared = self._open.get(name)
            if shared is not None and shared.users == 0 and await self.work(shared.opened.is_outdated):
                self._open.pop(name, None)
                shared = None
            if shared is None:
                await self._forget()
                if len(self._open) >= _MAX_OPEN:
                    raise SessionError("session.too_many_open", limit=_MAX_OPEN)
                path = self.folder / name
                opened = await self.work(lambda: OpenDocument.open(path, self._pilot_class))
                shared = SharedDocument(opened)
            if package_only:
                async with shared.lock:
                    shared.opened.extend_package_only()
            self._open[name] = shared
            shared.users += 1
        return shared

    async def keep(self) -> None:
        """Write the journals of all documents, warn their pages if that fails, close those left long ago."""

        async def keep(shared: SharedDocument) -> None:
            async with shared.lock:
                problem = await self.work(shared.opened.keep)
            if problem is not None:
                for viewer in shared.viewers:
                    viewer.warn(problem)

        await asyncio.gather(*(keep(shared) for shared in self._open.values()))
        await self._forget()

    async def _forget(self) -> None:
        for name, shared in list(self._open.items()):
            is_full = len(self._open) >= _MAX_OPEN and shared.users == 0
            if is_full or not shared.lingers():
                async with shared.lock:
                    await self.work(shared.opened.keep)
                if shared.users == 0 and self._open.get(name) is shared:  # nobody has opened it meanwhile
                    del self._open[name]

    def create(self, name: str, source: str, owner: str = "") -> str:
        """Make a mission file.

        Args:
            name: of the mission.
            source: "empty", "example", or a mission of the package to copy.
            owner: key of the pupil whose it is; "": nobody's.

        Returns:
            The file's name. Raises `SessionError`.
        """
        _check_name(name)
        if source == "empty":
            text = EMPTY_CHART.format(name=name)
        elif source == "example":
            (text,) = new_mission(name, self.folder, python=False).texts.values()
        elif (installed := installed_mission(source)) is not None:
            text = read_text(installed)
            text = re.sub(rf"(?m)^name: {source}$", f"name: {name}", text, count=1)
        else:
            raise SessionError("session.source", name=source[:80])
        return self.write(name, text, owner)

    def write(self, name: str, text: str, owner: str = "") -> str:
        """Make a mission file with a text, see `create`; return its name. Raises `SessionError`."""
        _check_name(name)
        path = self.folder / (f"{name}-{owner}.yaml" if owner else f"{name}.yaml")
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            make_file(path, text)
        except FileExistsError:
            raise SessionError("session.taken", name=path.name) from None
        except OSError as error:
            raise SessionError("session.not_written", name=path.name, **write_problem(error)) from None
        return path.name


def _can_be_opened(path: Path) -> bool:
    with contextlib.suppress(OSError):
        return resolved_in_folder(path).is_file()
    return False


def _check_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        raise SessionError("session.name", name=name[:80])
