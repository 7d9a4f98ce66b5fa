"""YAML files that people write: found by name or path, read with a limit, and checked against a model.

What is wrong with a file is reported in one line: file, line, field, value and what to do.
"""

from __future__ import annotations

import difflib
import json
import stat
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any, Generic, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from framerunner.errors import UserError
from framerunner.files.extensions import Kind, extension_names, find_extension
from framerunner.files.text_file import TextError, decode_text, read_bytes
from scenarios.part import field_path
from scenarios.yaml_tree import Path as FieldPath
from scenarios.yaml_tree import YamlError, YamlTree, parse_yaml

MAX_BYTES = 1_000_000
MAX_VALUE_LENGTH = 60  # characters of a value or path shown in a message
SUFFIXES = (".yaml", ".yml")

_COMPARISONS = {
    "greater_than": "must be above {gt}",
    "greater_than_equal": "must be at least {ge}",
    "less_than": "must be below {lt}",
    "less_than_equal": "must be at most {le}",
    "string_too_long": "must have at most {max_length} characters",
    "literal_error": "must be {expected}",
}
_TYPES = {
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "string_type": "must be text",
    "tuple_type": "must be a list",
    "model_type": "must hold fields, each written `name: value`",
    "too_long": "must be one number each for three axes",
    "string_pattern_mismatch": "must be small letters, digits, - and _, a letter or digit first",
}

Model = TypeVar("Model", bound=BaseModel)


@dataclass(frozen=True, slots=True)
class FileKind(Generic[Model]):
    """A kind of file. All methods raise its error, with one line for people."""

    name: str  # "scenario" or the like, for messages
    model: type[Model]
    error: type[UserError]
    folder: str  # of the package, with the files that are installed with it
    package: str = "scenarios"
    extension: Kind | None = None  # what other packages may add

    def own_names(self) -> list[str]:
        """Names of the files of this package, sorted."""
        files = (each.name for each in self._folder().iterdir())
        return sorted(name.removesuffix(".yaml") for name in files if name.endswith(".yaml"))

    def names(self) -> list[str]:
        """Names of all installed files, other packages' too, sorted."""
        added = [] if self.extension is None else extension_names(self.extension)
        return sorted({*self.own_names(), *added})

    def load(self, name_or_path: str | Path) -> Model | None:
        """Load a file.

        Args:
            name_or_path: one of `names`, or a path: it has a directory or ends in .yaml or .yml.

        Returns:
            The content; None if no file of this name is installed.
        """
        text = str(name_or_path)
        if isinstance(name_or_path, Path) or text.endswith(SUFFIXES) or "/" in text or "\\" in text:
            return self.parse(self.read(Path(text), self.names()), _shorten(text))
        if text in self.own_names():
            entry = self._folder() / f"{text}.yaml"
            return self.parse(entry.read_bytes(), entry.name)
        added = None if self.extension is None else find_extension(self.extension, text)
        return None if added is None else self.parse(self.read(added.path()), str(added.path()))

    def unknown(self, name: str, nearest: Sequence[str] = (), others: str = "") -> UserError:
        """Make the error for a name that `load` does not find.

        Args:
            name: as given.
            nearest: the name that was probably meant, if it is not in `names`.
            others: further names that can be given, in words.
        """
        names = self.names()
        nearest = nearest or difflib.get_close_matches(name.lower(), names, n=1, cutoff=0.5)
        hint = f"; did you mean {nearest[0]}?" if nearest else ";"
        known = f"{', '.join(names)}{others}; or give the path of a .yaml file"
        return self.error(f"unknown {self.name} {_show(name)}{hint} Known: {known}")

    def parse(self, content: bytes | str, source: str) -> Model:
        """Check the content of a file: YAML, as UTF-8 when bytes. `source`: its name in messages."""
        tree = self._tree(content, source)
        try:
            return self.model.model_validate(tree.value, strict=True)
        except ValidationError as error:
            faults = [(_path(fault), fault) for fault in error.errors(include_url=False)]
            path, fault = min(faults, key=lambda each: tree.line(each[0]))
            more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
            words = _describe(self, path, fault)
            raise self.error(f"{source}:{tree.line(path)}: {words}{more}") from None

    def _folder(self) -> Traversable:
        return resources.files(self.package) / self.folder

    def read(self, path: Path, known: Sequence[str] = ()) -> bytes:
        """Read a file that may be anything, but never more than is allowed; the known names are told."""
        name, kind, error = _shorten(str(path)), self.name, self.error
        try:
            status = path.stat()
            if stat.S_ISDIR(status.st_mode):
                raise error(f"{name}: is a directory; give a {kind} file")
            if not stat.S_ISREG(status.st_mode):
                raise error(f"{name}: is not a regular file; give a {kind} file")
            if status.st_size > MAX_BYTES:
                raise error(f"{name}: {status.st_size} bytes is too large for a {kind}; {MAX_BYTES} at most")
            return read_bytes(path, MAX_BYTES)
        except FileNotFoundError:
            others = f" or one of: {', '.join(known)}" if known else ""
            raise error(f"{name}: no such file; give a path{others}") from None
        except (OSError, ValueError, TextError) as failure:
            reason = getattr(failure, "strerror", None) or getattr(failure, "reason", None) or str(failure)
            raise error(f"{name}: cannot be read: {reason}") from None

    def _tree(self, content: bytes | str, source: str) -> YamlTree:
        kind, error = self.name, self.error
        if len(content) > MAX_BYTES:
            raise error(f"{source}: {len(content)} bytes is too large for a {kind}; {MAX_BYTES} at most")
        try:
            tree = parse_yaml(content if isinstance(content, str) else decode_text(content))
        except TextError as failure:
            words = "not UTF-8 text; save the file as UTF-8" if failure.fault == "not_utf8" else str(failure)
            raise error(f"{source}:{failure.line or 1}: {words}") from None
        except YamlError as failure:
            where = f"{failure.line}" if failure.column is None else f"{failure.line}:{failure.column}"
            raise error(f"{source}:{where}: {' '.join(str(failure).split())}") from None
        if tree.value is None:
            raise error(f"{source}:1: empty; a {kind} needs at least `name: my-{kind}`")
        if not isinstance(tree.value, dict):
            what = _show(tree.value)
            raise error(f"{source}:{tree.line(())}: must hold fields like `name: my-{kind}`, not {what}")
        return tree


def _path(fault: ErrorDetails) -> FieldPath:
    """Keys and indices to the bad value; a `refusal` has the rest of its path in its context."""
    return (*fault["loc"], *fault.get("ctx", {}).get("at", ()))


def _describe(kind: FileKind[Any], path: FieldPath, fault: ErrorDetails) -> str:
    """Say in words what one of `ValidationError.errors()` reports."""
    name = _shorten(field_path(path)) or kind.name
    code, value, context = fault["type"], fault["input"], fault.get("ctx", {})
    if code == "missing":
        return f"{name} is missing; add it"
    if code == "extra_forbidden":
        return f"{name} is not a known field; {_nearest_field(kind.model, path)}"
    if code == "refused":
        return f"{name} {context['value']} {context['message']}"
    shown = "empty" if value is None else _show(value)
    if code in _COMPARISONS:
        return f"{name} is {shown}: {_COMPARISONS[code].format_map(context)}"
    return f"{name} is {shown}: {_TYPES.get(code, fault['msg'])}"


def _nearest_field(model: type[BaseModel], path: FieldPath) -> str:
    """Say which fields there are beside an unknown one, or which of them was probably meant."""
    for step in path[:-1]:
        if isinstance(step, int):
            continue
        annotation = model.model_fields[step].annotation
        candidates = (annotation, *get_args(annotation))
        model = next(each for each in candidates if isinstance(each, type) and issubclass(each, BaseModel))
    names = list(model.model_fields)
    nearest = difflib.get_close_matches(str(path[-1]), names, n=1, cutoff=0.5)
    return f"did you mean {nearest[0]}?" if nearest else f"known here: {', '.join(names)}"


def _shorten(text: str) -> str:
    """Make a value or path fit for a message: one line of printable characters, not too long."""
    line = "".join(char if char.isprintable() else "?" for char in " ".join(text.split()))
    return line if len(line) <= MAX_VALUE_LENGTH else line[: MAX_VALUE_LENGTH - 1] + "…"


def _show(value: object) -> str:
    """Write a value as in YAML, short enough for a message."""
    return _shorten(json.dumps(value, ensure_ascii=False, default=str))
