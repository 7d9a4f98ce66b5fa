"""Files that people write: read with a limit, parsed, refused with file and line."""

from __future__ import annotations

import stat
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from errors import UserError
from scenarios.complaints import shorten, show
from scenarios.yaml_tree import YamlError, YamlTree, parse_yaml

MAX_BYTES = 1_000_000
SUFFIXES = (".yaml", ".yml")


@dataclass(frozen=True, slots=True)
class FileKind:
    """A kind of file, and how it is refused.

    Attributes:
        name: "scenario" or the like, for messages.
        error: raised with one line for people.
    """

    name: str
    error: type[UserError]

    def read(self, path: Path, known: list[str]) -> bytes:
        """Read a file that may be anything, but never more than is allowed.

        Args:
            path: the file.
            known: names that could have been given instead.
        """
        name, kind, error = shorten(str(path)), self.name, self.error
        try:
            status = path.stat()
            if stat.S_ISDIR(status.st_mode):
                raise error(f"{name}: is a directory; give a {kind} file")
            if not stat.S_ISREG(status.st_mode):
                raise error(f"{name}: is not a regular file; give a {kind} file")
            if status.st_size > MAX_BYTES:
                raise error(f"{name}: {status.st_size} bytes is too large for a {kind}; {MAX_BYTES} at most")
            with path.open("rb") as file:
                return file.read(MAX_BYTES + 1)
        except FileNotFoundError:
            raise error(f"{name}: no such file; give a path or one of: {', '.join(known)}") from None
        except (OSError, ValueError) as failure:
            reason = failure.strerror if isinstance(failure, OSError) else str(failure)
            raise error(f"{name}: cannot be read: {reason}") from None

    def parse(self, content: bytes | str, source: str) -> YamlTree:
        """Parse a file that must hold fields.

        Args:
            content: YAML, as UTF-8 when bytes.
            source: what to call it in messages.
        """
        kind, error = self.name, self.error
        if len(content) > MAX_BYTES:
            raise error(f"{source}: {len(content)} bytes is too large for a {kind}; {MAX_BYTES} at most")
        try:
            tree = parse_yaml(content if isinstance(content, str) else content.decode("utf-8-sig"))
        except UnicodeDecodeError as failure:
            line = failure.object.count(b"\n", 0, failure.start) + 1
            raise error(f"{source}:{line}: not UTF-8 text; save the file as UTF-8") from None
        except YamlError as failure:
            where = f"{failure.line}" if failure.column is None else f"{failure.line}:{failure.column}"
            raise error(f"{source}:{where}: {' '.join(str(failure).split())}") from None
        if tree.value is None:
            raise error(f"{source}:1: empty; a {kind} needs at least `name: my-{kind}`")
        if not isinstance(tree.value, dict):
            what = show(tree.value)
            raise error(f"{source}:{tree.line(())}: must hold fields like `name: my-{kind}`, not {what}")
        return tree


def packaged(folder: str) -> list[str]:
    """Names of the files in a folder of this package, sorted."""
    files = resources.files("scenarios") / folder
    return sorted(each.name.removesuffix(".yaml") for each in files.iterdir() if each.name.endswith(".yaml"))


def is_path(name_or_path: str | Path) -> bool:
    """Whether a file is meant, not a name."""
    text = str(name_or_path)
    return isinstance(name_or_path, Path) or text.endswith(SUFFIXES) or "/" in text or "\\" in text
