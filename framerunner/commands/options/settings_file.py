"""Options of a command in a file: `--settings flight.yaml`, one `option: value` a line, without dashes."""

from __future__ import annotations

from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Annotated, Any, get_args

from cyclopts import Token
from pydantic import BeforeValidator, ConfigDict, create_model

from framerunner.commands.options.flight import SETTINGS
from framerunner.errors import SettingError
from framerunner.files.yaml_file import FileKind

if TYPE_CHECKING:
    from cyclopts.argument import Argument, ArgumentCollection


def read_settings(path: Path, arguments: ArgumentCollection) -> None:
    """Give a command the options of a settings file that the command line does not give.

    Raises `SettingError` with one line.
    """
    known = {
        argument.name.removeprefix("--"): argument
        for argument in arguments
        if argument.name.startswith("--") and argument.name != SETTINGS and argument.show
    }
    types: dict[str, Any] = {name: (_type_of(argument.hint), None) for name, argument in known.items()}
    model = create_model("Options", __config__=ConfigDict(extra="forbid"), **types)
    files = FileKind("settings", model, SettingError, folder="", example="max-speed: 0.5")
    content = files.parse(files.read(path), str(path))
    for name in content.model_fields_set:
        if not known[name].tokens:
            _give(known[name], getattr(content, name), str(path))


def _as_text(value: object) -> object:
    """A number as text: `camera: 0`."""
    return str(value) if isinstance(value, int | float) and not isinstance(value, bool) else value


_Text = Annotated[str, BeforeValidator(_as_text)]


def _type_of(hint: Any) -> Any:  # noqa: ANN401 - types of any form
    """The type of an option's values in a file, where a path is a text and None is not written."""
    kind = next(
        (each for each in get_args(hint) if NoneType in get_args(hint) and each is not NoneType), hint
    )
    if kind == tuple[str, ...]:
        return tuple[_Text, ...]
    return _Text if kind in (str, Path) else kind


def _give(argument: Argument, value: object, source: str) -> None:
    """Do as if the command line had given an option."""
    if isinstance(value, bool):
        argument.append(Token(keyword=argument.name, implicit_value=value, source=source))
    else:
        for each in value if isinstance(value, tuple) else (value,):
            argument.append(Token(keyword=argument.name, value=str(each), source=source))
