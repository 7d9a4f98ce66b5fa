"""What other installed packages add to this one, by entry points.

A package names in its metadata what it adds: an entry point of the group `framerunner.KIND` for each. The
name is read from the metadata only; a package's code runs when somebody uses the name.
"""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Literal, get_args

from framerunner.errors import UserError

Kind = Literal["mission", "pilot", "detector", "level", "airframe", "sensors"]
KINDS: tuple[Kind, ...] = get_args(Kind)
_GROUPS: dict[Kind, str] = {
    kind: f"framerunner.{kind if kind == 'sensors' else f'{kind}s'}" for kind in KINDS
}


class ExtensionError(UserError):
    """What a package adds cannot be used; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class Extension:
    """One entry point of a package; `str` of it is for people: "gate_net of my-drone 1.0"."""

    kind: Kind
    name: str
    package: str
    version: str
    entry: metadata.EntryPoint

    def __str__(self) -> str:
        return f"{self.name} of {self.package} {self.version}"

    def load(self) -> Any:  # noqa: ANN401 - whoever asks checks what it is
        """What the entry point names; the package is imported. Raises `ExtensionError`."""
        try:
            return self.entry.load()
        except Exception as error:  # the package's code may raise anything
            raise self.refused(f"cannot be loaded: {type(error).__name__}: {error}") from error

    def path(self) -> Path:
        """The file that the entry point names.

        Raises:
            ExtensionError: the package cannot be imported, or it names no file.
        """
        value = self.load()
        if not isinstance(value, str | os.PathLike):
            raise self.refused(f"is no path of a YAML file but {type(value).__name__}")
        path = Path(value)
        if not path.is_file():
            raise self.refused(f"has no file {path}")
        return path

    def refused(self, reason: str) -> ExtensionError:
        """The error for a bad entry point."""
        return ExtensionError(
            f"{self.kind} {self}: {' '.join(reason.split())}; correct its entry point "
            f'{self.name} = "{self.entry.value}" of {self.entry.group}, or uninstall {self.package}'
        )


def extensions(kind: Kind) -> list[Extension]:
    """All of a kind that packages add, sorted by name; two packages may add one name."""
    found = [
        Extension(kind, entry.name, entry.dist.name, entry.dist.version, entry)
        for entry in metadata.entry_points(group=_GROUPS[kind])
        if entry.dist is not None
    ]
    return sorted(found, key=lambda each: (each.name, each.package))


def extension_names(kind: Kind) -> list[str]:
    """The names of a kind that packages add, sorted."""
    return sorted({each.name for each in extensions(kind)})


def find_extension(kind: Kind, name: str) -> Extension | None:
    """What a package adds by this name; None if none does. Ask first for our own, which come first.

    Raises:
        ExtensionError: two packages add it.
    """
    found = [each for each in extensions(kind) if each.name == name]
    if len(found) > 1:
        packages = " and ".join(each.package for each in found)
        raise ExtensionError(f"{kind} {name}: {packages} both add it; uninstall one of them")
    return found[0] if found else None
