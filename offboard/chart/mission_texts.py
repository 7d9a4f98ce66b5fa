"""What is said of mission files: a code and values; the words are in `texts.yaml`, by code and language."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import TypeAdapter

from framerunner.files.text_file import read_text
from framerunner.files.yaml_text import read_yaml

Language = Literal["en", "es"]


class Message:
    """A text with its values, some of which may be messages again.

    Attributes:
        code: key of the table, such as "state.no_way_out".
        values: of the names in braces.
        table: the file with the words.
    """

    __slots__ = ("code", "values")
    table: ClassVar[Path] = Path(__file__).with_name("texts.yaml")

    def __init__(self, code: str, /, **values: object) -> None:
        self.code = code
        self.values = values

    def text(self, language: Language = "en") -> str:
        """The words in a language."""
        values = {
            name: value.text(language) if isinstance(value, Message) else value
            for name, value in self.values.items()
        }
        return texts_of(self.table)[self.code][language].format(**values)

    def __str__(self) -> str:
        return self.text()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Message) and (self.code, self.values) == (other.code, other.values)

    def __hash__(self) -> int:
        return hash(self.code)


def as_message(text: Message | str) -> Message:
    """A text that is in no table, such as the reason of a library, as a message."""
    return text if isinstance(text, Message) else Message("plain", text=text)


@cache
def texts_of(table: Path) -> Mapping[str, Mapping[Language, str]]:
    """The words of a table, by code and language."""
    return TypeAdapter(dict[str, dict[Language, str]]).validate_python(read_yaml(read_text(table)))
