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
from operator import itemgetter
from pathlib import Path
from typing import Any, Generic, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails, PydanticCustomError

from framerunner.errors import UserError
from framerunner.files.extensions import Kind, extension_names, find_extension
from framerunner.files.text_file import MAX_TEXT_BYTES, TextError, decode_text, read_bytes
from framerunner.files.yaml_text import MapNode, Scalar, YamlError, compose, follow, plain
from framerunner.files.yaml_text import Path as FieldPath

MAX_VALUE_LENGTH = 60  # characters of a value or path shown in a message
SUFFIXES = (".yaml", ".yml")

_COMPARISONS = {
    "greater_than": "must be above {gt}",
    "greater_than_equal": "must be at least {ge}",
    "less_than": "must be below {lt}",
    "less_than_equal": "must be at most {le}",
    "too_short": "must have at least {min_length} items",
    "string_too_long": "must have at most {max_length} characters",
    "literal_error": "must be {expected}",
}
_TYPES = {
    "bool_type": "must be true or false",
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "int_type": "must be a whole number",
    "string_type": "must be text",
    "tuple_type": "must be a list",
    "model_type": "must hold fields, each written `name: value`",
    "too_long": "must be one number each for three axes",
}
_SHAPES = {  # of texts, by pattern
    r"^[a-z0-9][a-z0-9_-]*$": "must be small letters, digits, - and _, a letter or digit first",
    r"^[A-Z][A-Z0-9_]{0,15}$": "must be at most 16 capital letters, digits and _, a letter first",
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
    example: str = ""  # of a field, for messages; if not given the name

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
            return self.parse(self.read(Path(text), self.names()), _shorten_path(text))
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
        root = self._root(content, source)
        try:
            return self.model.model_validate(plain(root), strict=True)
        except ValidationError as error:
            faults = [(*_place(root, fault), fault) for fault in error.errors(include_url=False)]
            line, path, fault = min(faults, key=itemgetter(0))
            more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
            raise self.error(f"{source}:{line}: {_describe(self, path, fault)}{more}") from None

    def _folder(self) -> Traversable:
        return resources.files(self.package) / self.folder

    def read(self, path: Path, known: Sequence[str] = ()) -> bytes:
        """Read a file that may be anything, but never more than is allowed; the known names are told."""
        name, kind, error = _shorten_path(str(path)), self.name, self.error
        try:
            status = path.stat()
            if stat.S_ISDIR(status.st_mode):
                raise error(f"{name}: is a directory; give a {kind} file")
            if not stat.S_ISREG(status.st_mode):
                raise error(f"{name}: is not a regular file; give a {kind} file")
            if status.st_size > MAX_TEXT_BYTES:
                raise error(
                    f"{name}: {status.st_size} bytes is too large for a {kind}; {MAX_TEXT_BYTES} at most"
                )
            return read_bytes(path)
        except FileNotFoundError:
            others = f" or one of: {', '.join(known)}" if known else ""
            raise error(f"{name}: no such file; give a path{others}") from None
        except (OSError, ValueError, TextError) as failure:
            reason = getattr(failure, "strerror", None) or getattr(failure, "reason", None) or str(failure)
            raise error(f"{name}: cannot be read: {reason}") from None

    def _root(self, content: bytes | str, source: str) -> MapNode:
        kind, error = self.name, self.error
        if len(content) > MAX_TEXT_BYTES:
            raise error(f"{source}: {len(content)} bytes is too large for a {kind}; {MAX_TEXT_BYTES} at most")
        try:
            root = compose(content if isinstance(content, str) else decode_text(content), source)
        except TextError as failure:
            words = "not UTF-8 text; save the file as UTF-8" if failure.fault == "not_utf8" else str(failure)
            raise error(f"{source}:{failure.line or 1}: {words}") from None
        except YamlError as failure:
            raise error(f"{failure.place}: {failure}") from None
        example = self.example or f"name: my-{kind}"
        if root is None or plain(root) is None:
            raise error(f"{source}:1: empty; it needs at least `{example}`")
        if not isinstance(root, MapNode):
            what = _show(plain(root))
            raise error(f"{source}:{root.place.line}: must hold fields like `{example}`, not {what}")
        return root


def refusal(value: float | str, message: str, *at: str | int) -> PydanticCustomError:
    """Make a validation error that has the path of the bad value, so that a file's line can be named.

    Args:
        value: the bad value, which may be a default.
        message: what is wrong and how to correct it; one line that continues after the value.
        *at: keys and indices from the validated part to the value.
    """
    context = {"field": field_path(at), "value": value, "message": message, "at": at}
    return PydanticCustomError("refused", "{field} {value} {message}", context)


def field_path(at: tuple[str | int, ...]) -> str:
    """Write keys and indices as one text: ("frames", 1, "x_m") is "frames[1].x_m"."""
    text = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in at)
    return text.removeprefix(".")


def _place(root: MapNode, fault: ErrorDetails) -> tuple[int, FieldPath]:
    """Line, keys and indices of the bad value; a `refusal` has the rest of its path in its context.

    The line of a missing value is that of the part in which it should be.
    """
    path: FieldPath = (*fault["loc"], *fault.get("ctx", {}).get("at", ()))
    nodes = follow(root, path)
    place, last = nodes[-1]
    return place.line, path[: len(nodes) - 1] if isinstance(last, Scalar) else path


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
    words = _SHAPES.get(context.get("pattern", ""), _TYPES.get(code, fault["msg"]))
    return f"{name} is {shown}: {words}"


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
    """Make a value fit for a message: one line of printable characters, not too long."""
    line = "".join(char if char.isprintable() else "?" for char in " ".join(text.split()))
    return line if len(line) <= MAX_VALUE_LENGTH else line[: MAX_VALUE_LENGTH - 1] + "…"


def _shorten_path(path: str) -> str:
    """Make a path fit for a message: its end, which names the file."""
    return _shorten(path[::-1])[::-1]


def _show(value: object) -> str:
    """Write a value as in YAML, short enough for a message."""
    return _shorten(json.dumps(value, ensure_ascii=False, default=str))
