"""The missions of one folder, opened by pages; pages that show the same file share its document."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from errors import UserError
from framerunner.editing.documents.open_document import OpenDocument
from offboard.mission import MISSIONS, list_missions, new_mission

_FILE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,80}\.ya?ml")
_NAME = re.compile(r"[a-z][a-z0-9_]{0,59}")
_MAX_LISTED = 500
_MAX_OPEN = 50

EMPTY_CHART = """\
name: {name}
description: A new mission
initial: start

states:
  start:
"""


class DeskError(UserError):
    """A file that cannot be opened or made; the message is one line for people."""


@dataclass(slots=True)
class SharedDocument:
    """An open document and the pages that show it.

    Attributes:
        opened: the document.
        viewers: called with each message for all pages.
    """

    opened: OpenDocument
    viewers: list[Callable[[dict[str, object]], None]] = field(default_factory=list)


class EditorDesk:
    """Opens and makes missions in a folder. Pages name files, never paths.

    Args:
        folder: with the missions.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._open: dict[str, SharedDocument] = {}

    def files(self) -> list[str]:
        """Names of the YAML files in the folder, sorted."""
        try:
            names = [each.name for each in self.folder.iterdir() if each.is_file()]
        except OSError:
            return []
        return sorted(name for name in names if _FILE.fullmatch(name))[:_MAX_LISTED]

    def open(self, name: str) -> SharedDocument:
        """A file's document. Raises `DeskError` or `MissionError`."""
        shared = self._open.get(name)
        if shared is None:
            if not _FILE.fullmatch(name):
                raise DeskError(f"'{name[:80]}' is no mission file of this folder; choose one from the list")
            if len(self._open) >= _MAX_OPEN:
                raise DeskError(f"{_MAX_OPEN} missions are open; close some pages first")
            shared = self._open[name] = SharedDocument(OpenDocument.open(self.folder / name))
        return shared

    def close(self, name: str) -> None:
        """A page has left; the last one closes the document, whose unsaved text is kept in its journal."""
        shared = self._open.get(name)
        if shared is not None and not shared.viewers:
            shared.opened.keep()
            del self._open[name]

    def keep(self) -> None:
        """Write the journals of all documents."""
        for shared in self._open.values():
            shared.opened.keep()

    def create(self, name: str, source: str) -> str:
        """Make a mission file.

        Args:
            name: of the mission.
            source: "empty", "example", or a mission of the package to copy.

        Returns:
            The file's name. Raises `DeskError`.
        """
        _check_name(name)
        if source == "empty":
            text = EMPTY_CHART.format(name=name)
        elif source == "example":
            (text,) = new_mission(name, self.folder, python=False).texts.values()
        elif source in list_missions():
            text = (MISSIONS / f"{source}.yaml").read_text(encoding="utf-8")
            text = re.sub(rf"(?m)^name: {source}$", f"name: {name}", text, count=1)
        else:
            raise DeskError(f"unknown source '{source[:80]}'; use empty, example or a mission of the package")
        return self.write(name, text)

    def write(self, name: str, text: str) -> str:
        """Make a mission file with a text; return its name. Raises `DeskError`."""
        _check_name(name)
        path = self.folder / f"{name}.yaml"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with path.open("x", encoding="utf-8", newline="") as file:
                file.write(text)
        except FileExistsError:
            raise DeskError(f"{path.name} is there already; choose another name") from None
        except OSError as error:
            raise DeskError(f"{path.name}: cannot be written ({error.strerror})") from None
        return path.name


def _check_name(name: str) -> None:
    if not _NAME.fullmatch(name):
        raise DeskError(f"'{name[:80]}': use small letters, digits and _, a letter first")
