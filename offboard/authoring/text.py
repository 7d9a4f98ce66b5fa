"""The text of a mission file as an editor sees it, and changes of it that can be taken back.

An editor's lines end with a line feed. The file's own line ends and its byte order mark are kept beside the
text, line by line, so that a file that is opened and saved is the same to the byte.
"""

from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

_LINE_END = re.compile(r"\r\n|\r|\n")
_BYTE_ORDER_MARK = "\ufeff"
_WIDE = re.compile("[\U00010000-\U0010ffff]")  # two units of UTF-16
_MAX_CHANGES = 20  # that an edit makes; more are one, so that applying and telling them takes linear time


@dataclass(frozen=True, slots=True)
class TextChange:
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
    def inverse(self) -> TextChange:
        """What takes this change back."""
        return TextChange(self.start, self.inserted, self.removed, self.inserted_ends, self.removed_ends)

    def with_letters(self, then: TextChange) -> TextChange:
        """This change of letters and the next one, of letters beside them; both add, or both delete."""
        if self.inserted:
            return TextChange(self.start, "", self.inserted + then.inserted)
        first, second = (self, then) if then.start == self.start else (then, self)
        return TextChange(then.start, first.removed + second.removed, "")


# Offsets of the first character and of the one after the last, and the text that is put there.
Part = tuple[int, int, str]


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

    def changes(self, parts: Sequence[Part]) -> tuple[TextChange, ...]:
        """The changes that put texts in the place of parts of this text; one change for all if they are many.

        Args:
            parts: from the last to the first, apart from each other; their offsets are those of this text.

        Returns:
            The changes, in order; each is made for the text after those before it.
        """
        if len(parts) > _MAX_CHANGES:
            return (self._joined(parts[::-1]),)
        return tuple(self._joined((part,)) for part in parts)

    def _joined(self, parts: Sequence[Part]) -> TextChange:
        """One change for all parts, given from the first to the last; line ends between them are kept."""
        begin, end = parts[0][0], parts[-1][1]
        first = line = self.text.count("\n", 0, begin)
        texts: list[str] = []
        ends: list[str] = []
        place = begin
        for start, stop, text in parts:
            count = self.text.count("\n", place, start)
            new = _LINE_END.sub("\n", text)
            texts += (self.text[place:start], new)
            ends += self.line_ends[line : line + count]
            ends += (self.usual_end,) * new.count("\n")
            line += count + self.text.count("\n", start, stop)
            place = stop
        removed_ends = self.line_ends[first:line]
        return TextChange(begin, self.text[begin:end], "".join(texts), removed_ends, tuple(ends))

    def typed(self, changes: Sequence[tuple[int, int, str]]) -> TextChange:
        """The one change that does what typed ones do. Their number times the length of the text is copied.

        Args:
            changes: each made for the text after those before it: first character and number of those
                that are replaced, counted as JavaScript does, and what replaces them.

        Raises:
            IndexError: with a place after the end of the text.
            UnicodeError: half of a character is left.
        """
        # The bytes between which JavaScript counts; a line end is one character, also if the file has two.
        marks = self._marks("".join(new for _, _, new in changes))
        usual = marks[self.usual_end]
        before = self._marked(marks).encode("utf-16-le")
        after = bytearray(before)
        kept = rest = len(before)  # at the start and at the end
        for first, removed, new in changes:
            start, end = 2 * first, 2 * (first + removed)
            if end > len(after):
                raise IndexError(first + removed)
            kept, rest = min(kept, start), min(rest, len(after) - end)
            after[start:end] = _LINE_END.sub(usual, new).encode("utf-16-le")
        if not changes:
            return TextChange(0, "", "")
        old = before[kept : len(before) - rest].decode("utf-16-le")
        put = after[kept : len(after) - rest].decode("utf-16-le")
        ends = {mark: end for end, mark in marks.items()}
        any_mark = re.compile("|".join(map(re.escape, ends)))

        def ends_in(text: str) -> tuple[str, ...]:
            return tuple(ends[each] for each in any_mark.findall(text))

        start = len(before[:kept].decode("utf-16-le"))
        removed_text, inserted = (any_mark.sub("\n", each) for each in (old, put))
        return TextChange(start, removed_text, inserted, ends_in(old), ends_in(put))

    def _marks(self, more: str) -> dict[str, str]:
        """For each line end that the file has, a character that is not in the text nor in another one."""
        kinds = list(dict.fromkeys((self.usual_end, *self.line_ends)))
        used = set(self.text) | set(more) if len(kinds) > 1 else set()
        free = (chr(code) for code in range(0xE000, 0xF8FF) if chr(code) not in used)
        return {kinds[0]: "\n", **dict(zip(kinds[1:], free, strict=False))}

    def _marked(self, marks: dict[str, str]) -> str:
        if len(marks) == 1:
            return self.text
        ends = (*(marks[end] for end in self.line_ends), "")
        return "".join(line + end for line, end in zip(self.text.split("\n"), ends, strict=True))

    def changed(self, change: TextChange) -> MissionText:
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
        return offset + bisect_left(self._wide, offset)

    @cached_property
    def _wide(self) -> list[int]:
        """Offsets of the characters beyond U+FFFF."""
        return [] if self._text.isascii() else [found.start() for found in _WIDE.finditer(self._text)]
