"""The text of a mission file as an editor sees it, and changes of it that can be taken back.

An editor's lines end with a line feed. The file's own line ends and its byte order mark are kept beside the
text, line by line, so that a file that is opened and saved is the same to the byte.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from collections import Counter
from dataclasses import dataclass
from functools import cached_property

_LINE_END = re.compile(r"\r\n|\r|\n")
_BYTE_ORDER_MARK = "\ufeff"


@dataclass(frozen=True, slots=True)
class Change:
    """Some characters replaced by others.

    Attributes:
        start: offset of the first of them.
        removed, inserted: with line feeds as line ends.
        removed_ends, inserted_ends: the line ends that the file has in their place.
    """

    start: int
    removed: str
    inserted: str
    removed_ends: tuple[str, ...] = ()
    inserted_ends: tuple[str, ...] = ()

    @property
    def inverse(self) -> Change:
        """What takes this change back."""
        return Change(self.start, self.inserted, self.removed, self.inserted_ends, self.removed_ends)


@dataclass(frozen=True)
class MissionText:
    """A text, its lines ended by a line feed.

    Attributes:
        text: what the editor shows.
        line_ends: of each line that has one, in the file.
        has_mark: the file begins with a byte order mark.
    """

    text: str = ""
    line_ends: tuple[str, ...] = ()
    has_mark: bool = False

    @classmethod
    def of(cls, written: str) -> MissionText:
        """From a file's content, as decoded."""
        has_mark = written.startswith(_BYTE_ORDER_MARK)
        body = written[1:] if has_mark else written
        return cls(_LINE_END.sub("\n", body), tuple(_LINE_END.findall(body)), has_mark)

    @property
    def written(self) -> str:
        """The file's content."""
        lines = self.text.split("\n")
        ends = (*self.line_ends, "")
        body = "".join(line + end for line, end in zip(lines, ends, strict=True))
        return _BYTE_ORDER_MARK + body if self.has_mark else body

    @cached_property
    def usual_end(self) -> str:
        """The line end of most lines."""
        most = Counter(self.line_ends).most_common(1)
        return most[0][0] if most else "\n"

    def change(self, start: int, end: int, new: str) -> Change:
        """The change that puts a text in the place of the characters from `start` to `end`."""
        new = _LINE_END.sub("\n", new)
        first = self.text.count("\n", 0, start)
        count = self.text.count("\n", start, end)
        removed_ends = self.line_ends[first : first + count]
        return Change(start, self.text[start:end], new, removed_ends, (self.usual_end,) * new.count("\n"))

    def changed(self, change: Change) -> MissionText:
        """The text after a change that was made for it."""
        start, end = change.start, change.start + len(change.removed)
        assert self.text[start:end] == change.removed
        first = self.text.count("\n", 0, start)
        ends = self.line_ends
        return MissionText(
            self.text[:start] + change.inserted + self.text[end:],
            ends[:first] + change.inserted_ends + ends[first + len(change.removed_ends) :],
            self.has_mark,
        )


class Positions:
    """Converts between offsets and lines.

    Args:
        text: lines ended by a line feed.
    """

    def __init__(self, text: str) -> None:
        self._text = text
        self._starts = [0, *(found.end() for found in re.finditer("\n", text))]
        # YAML counts these as line ends too, editors do not.
        self._yaml_starts = [0, *(found.end() for found in re.finditer("[\n\x85\u2028\u2029]", text))]

    def line_column(self, offset: int) -> tuple[int, int]:
        """Line and column of an offset, both counted from 1."""
        line = bisect_right(self._starts, offset)
        return line, offset - self._starts[line - 1] + 1

    def line_start(self, offset: int) -> int:
        """Offset of the first character of the line that has an offset."""
        return self._starts[bisect_right(self._starts, offset) - 1]

    def line_end(self, offset: int) -> int:
        """Offset after the line feed of the line that has an offset; without one, the end of the text."""
        line = bisect_right(self._starts, offset)
        return self._starts[line] if line < len(self._starts) else len(self._text)

    def column(self, offset: int) -> int:
        """Characters before an offset in its line."""
        return offset - self.line_start(offset)

    def is_first_in_line(self, offset: int) -> bool:
        """Whether only spaces are before an offset in its line."""
        return not self._text[self.line_start(offset) : offset].strip()

    def offset_of_yaml(self, line: int, column: int) -> int:
        """Offset of a place that YAML's parser reported; lines and columns are counted from 1."""
        if line < 1:
            return 0
        start = self._yaml_starts[min(line, len(self._yaml_starts)) - 1]
        return min(start + max(column - 1, 0), len(self._text))

    def to_utf16(self, offset: int) -> int:
        """The same offset as JavaScript counts it: characters beyond U+FFFF count two."""
        return offset + sum(character > "\uffff" for character in self._text[:offset])

    def from_utf16(self, offset: int) -> int:
        """An offset counted as JavaScript does, in characters."""
        return len(self._text.encode("utf-16-le")[: 2 * offset].decode("utf-16-le", "ignore"))
