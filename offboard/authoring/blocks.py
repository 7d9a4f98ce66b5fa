"""Patches of YAML text: entries of mappings and items of lists are added, removed and replaced in place.

Both of YAML's styles are kept: lines of their own, where comments belong to what follows them at the same
indentation or to what they stand under; and braces and brackets. Nothing else of the text is touched.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher

from framerunner.files.yaml_text import ListNode, MapNode, Node, Scalar
from offboard.authoring.document import Document
from offboard.authoring.edit_texts import EditError
from offboard.authoring.outline import Span
from offboard.authoring.yaml_writer import Value, flow, style_of, written

Patch = tuple[int, int, str]
"""Characters from an offset to another are replaced by a text."""
_COMMENT = re.compile(r"([ \t]*)#")
_DASH = re.compile(r"(?m)^[ ]*-(?=\s|$)")


@dataclass(frozen=True, slots=True)
class Owner:
    """A mapping to which entries are added.

    Attributes:
        key: whose value it is; None for the outermost mapping.
        node: the mapping, or an empty scalar if nothing stands there yet.
        in_braces: the key itself stands in braces.
    """

    key: Scalar | None
    node: Node
    in_braces: bool = False


class Blocks:
    """Makes patches of one document.

    Args:
        document: whose YAML can be read.
    """

    def __init__(self, document: Document) -> None:
        self._text = document.text
        self._lines = document.positions
        self._style = style_of(document.nodes)
        self._known_dashes: dict[int, list[int]] = {}  # by where the list begins

    def add_entry(self, owner: Owner, key: str, value: Value, before: Sequence[str] = ()) -> Patch:
        """Add an entry to a mapping: after the last of the keys that go `before` it, or at its start."""
        node = owner.node
        if isinstance(node, MapNode) and node.items:
            previous = next((name for name in reversed(node.items) if name in before), "")
            if not node.flow:
                return self._add_line(node, previous, key, value)
            entry = f"{key}: {flow(value)}"
            if not previous:
                start = next(iter(node.key_nodes.values())).start
                return start, start, f"{entry}, "
            end = max(node.items[previous].end, node.key_nodes[previous].end)
            return end, end, f", {entry}"
        if isinstance(node, ListNode) or (isinstance(node, Scalar) and node.text):
            raise EditError("edit.no_mapping")
        if isinstance(node, MapNode) and node.flow:
            return node.start, node.end, f"{{{key}: {flow(value)}}}"
        if owner.in_braces:
            return node.start, node.start, f" {{{key}: {flow(value)}}}"
        lines = self._style.entry(key, value, self.child_indent(owner))
        return self._insert(self._lines.line_end(owner.key.end) if owner.key else len(self._text), lines)

    def _add_line(self, node: MapNode, previous: str, key: str, value: Value) -> Patch:
        first = next(iter(node.key_nodes.values()))
        indent = self._lines.column(first.start)
        if previous:
            return self._insert(self.entry(node, previous).end, self._style.entry(key, value, indent))
        lines = self._style.entry(key, value, indent)
        if not self._lines.is_first_in_line(first.start):  # after the dash of a list
            return first.start, first.start, "\n".join(lines).lstrip() + "\n" + " " * indent
        return self._insert(self._lines.line_start(first.start), lines)

    def remove_entry(self, node: MapNode, key: str) -> Patch:
        """Remove an entry of a mapping, with its comments."""
        names = list(node.items)
        index, own = names.index(key), node.key_nodes[key]
        if node.flow:
            ends = [max(node.key_nodes[name].end, node.items[name].end) for name in names]
            starts = [node.key_nodes[name].start for name in names]
            return _without_item(starts, ends, index)
        if not self._lines.is_first_in_line(own.start):
            if index + 1 == len(names):
                raise EditError("edit.all_there_is", key=key)
            return own.start, node.key_nodes[names[index + 1]].start, ""
        span = self.entry(node, key)
        return span.start, span.end, ""

    def entry(self, node: MapNode, key: str) -> Span:
        """The lines of an entry of a mapping that is not in braces, with the comments that belong to it."""
        own = node.key_nodes[key]
        return self._block(own.start, max(own.end, node.items[key].end), self._lines.column(own.start))

    def add_item(self, node: ListNode, index: int, value: Value) -> Patch:
        """Add an item to a list that has some, before the item with an index or at its end."""
        if node.flow:
            if index < len(node.items):
                start = node.items[index].start
                return start, start, f"{flow(value)}, "
            end = node.items[-1].end if node.items else node.start + 1
            return end, end, f", {flow(value)}" if node.items else flow(value)
        lines = self._style.item(value, self._lines.column(self._dashes(node)[0]))
        if index < len(node.items):
            return self._insert(self.item(node, index).start, lines)
        return self._insert(self.item(node, len(node.items) - 1).end, lines)

    def remove_item(self, node: ListNode, index: int) -> Patch:
        """Remove an item of a list, with its comments."""
        if node.flow:
            return _without_item([i.start for i in node.items], [i.end for i in node.items], index)
        span = self.item(node, index)
        return span.start, span.end, ""

    def move_item(self, node: ListNode, index: int, to: int) -> list[Patch]:
        """Put an item of a list at another index, with its comments."""
        if node.flow:
            texts = [self._text[item.start : item.end] for item in node.items]
            texts.insert(to, texts.pop(index))
            pairs = zip(node.items, texts, strict=True)
            return [(i.start, i.end, text) for i, text in pairs if self._text[i.start : i.end] != text]
        span = self.item(node, index)
        target = self.item(node, to)
        at = target.end if to > index else target.start
        lines = self._text[span.start : span.end].removesuffix("\n").split("\n")
        return [(span.start, span.end, ""), self._insert(at, lines)]

    def item(self, node: ListNode, index: int) -> Span:
        """The lines of an item of a list that is not in brackets, with the comments that belong to it."""
        dash = self._dashes(node)[index]
        if not self._lines.is_first_in_line(dash):
            raise EditError("edit.list_in_line")
        return self._block(dash, max(dash + 1, node.items[index].end), self._lines.column(dash))

    def set_list(self, owner: Owner, key: str, values: Sequence[Value], before: Sequence[str]) -> list[Patch]:
        """Make a list of texts have some values; only what differs is changed."""
        mapping = owner.node
        node = mapping.items.get(key) if isinstance(mapping, MapNode) else None
        if node is None:
            return [self.add_entry(owner, key, values, before)] if values else []
        assert isinstance(mapping, MapNode)
        if not values:
            return [self.remove_entry(mapping, key)]
        if isinstance(node, ListNode) and node.items and not node.flow:
            return self._set_items(node, values)
        if isinstance(node, ListNode) and node.flow:
            if "#" in self._text[node.start : node.end]:
                raise EditError("edit.brackets", key=key)
            return [(node.start, node.end, flow(values))]
        if isinstance(node, Scalar) and not node.text:
            if mapping.flow:
                return [(node.start, node.start, f" {flow(values)}")]
            lines = self._style.entry(key, values, self._lines.column(mapping.key_nodes[key].start))[1:]
            return [self._insert(self._lines.line_end(mapping.key_nodes[key].end), lines)]
        raise EditError("edit.no_list", key=key)

    def _set_items(self, node: ListNode, values: Sequence[Value]) -> list[Patch]:
        old = [item.text.strip() if isinstance(item, Scalar) else None for item in node.items]
        patches: list[Patch] = []
        for tag, first, last, start, end in SequenceMatcher(a=old, b=list(values)).get_opcodes():
            if tag == "equal":
                continue
            new = list(values[start:end])
            for index in range(first, last):
                item = node.items[index]
                if new and isinstance(item, Scalar) and isinstance(new[0], str):
                    patches.append(self.set_scalar(item, str(new.pop(0))))
                else:
                    patches.append(self.remove_item(node, index))
            if new:
                indent = self._lines.column(self._dashes(node)[0])
                lines = [line for value in new for line in self._style.item(value, indent)]
                at = self.item(node, last).start if last < len(old) else self.item(node, last - 1).end
                patches.append(self._insert(at, lines))
        return patches

    def set_scalar(self, node: Scalar, text: str, *, in_braces: bool = False) -> Patch:
        """Replace a text, in the quotation marks that it has."""
        if node.start == node.end:
            return node.start, node.end, f" {written(text, in_braces=in_braces)}"
        mark = self._text[node.start]
        if node.quoted and mark in "'\"" and text.isprintable():
            doubled = text.replace("'", "''") if mark == "'" else re.sub(r'(["\\])', r"\\\1", text)
            return node.start, node.end, f"{mark}{doubled}{mark}"
        return node.start, node.end, written(text, in_braces=in_braces)

    def insert_entry_text(self, node: MapNode, index: int, lines: list[str], *, apart: bool) -> Patch:
        """Insert lines as an entry of a mapping with entries, at an index; `apart`: with an empty line."""
        names = list(node.items)
        if index < len(names):
            return self._insert(self.entry(node, names[index]).start, [*lines, ""] if apart else lines)
        end = self.entry(node, names[-1]).end
        return self._insert(end, ["", *lines] if apart else lines)

    def remove_state(self, node: MapNode, key: str) -> Patch:
        """Remove an entry, and the empty lines after it if there are some before it, too."""
        if node.flow:
            return self.remove_entry(node, key)
        span = self.entry(node, key)
        start, end = span.start, span.end
        before = self._text[:start]
        if before.endswith("\n\n") or next(iter(node.items)) == key or end == len(self._text):
            end += len(self._text[end:]) - len(self._text[end:].lstrip("\n"))
            if end == len(self._text):
                start -= len(before) - len(before.rstrip("\n")) - 1 if before.endswith("\n") else 0
        return start, end, ""

    def child_indent(self, owner: Owner) -> int:
        """Indentation of the entries of a mapping that has none yet."""
        return 0 if owner.key is None else self._lines.column(owner.key.start) + self._style.step

    def shifted(self, span: Span, indent: int) -> list[str]:
        """The lines of an entry, moved so that its key has an indentation."""
        lines = self._text[span.start : span.end].removesuffix("\n").split("\n")
        own = next(len(line) - len(line.lstrip(" ")) for line in lines if not _COMMENT.match(line))
        by = indent - own
        if by >= 0:
            return [" " * by + line if line.strip() else line for line in lines]
        return [line[min(-by, len(line) - len(line.lstrip(" "))) :] for line in lines]

    def _dashes(self, node: ListNode) -> list[int]:
        """Where the dash of each item is."""
        known = self._known_dashes.get(node.start)
        if known is not None:
            return known
        found = [node.start]
        for previous in node.items[:-1]:
            after = _DASH.search(self._text, self._lines.line_end(max(previous.end, found[-1] + 1)))
            if after is None:
                raise EditError("edit.dashes")
            found.append(after.end() - 1)
        self._known_dashes[node.start] = found
        return found

    def _block(self, start: int, end: int, indent: int) -> Span:
        """Whole lines with comments: those above it at its indentation, and those below it, deeper."""
        first, last = self._lines.line_start(start), self._lines.line_end(max(start, end - 1))
        while first > 0:
            above = self._lines.line_start(first - 1)
            comment = _COMMENT.match(self._text[above:first])
            if comment is None or len(comment.group(1)) != indent:
                break
            first = above
        at = last
        while at < len(self._text):
            below = self._lines.line_end(at)
            line = self._text[at:below]
            comment = _COMMENT.match(line)
            if comment is not None and len(comment.group(1)) > indent:
                last = below
            elif line.strip():
                break
            at = below
        return Span(first, last)

    def _insert(self, at: int, lines: list[str]) -> Patch:
        """Insert whole lines at the beginning of a line, or at the end of the text."""
        block = "\n".join(lines)
        if at == len(self._text) and self._text and not self._text.endswith("\n"):
            return at, at, f"\n{block}"
        return at, at, f"{block}\n"


def _without_item(starts: list[int], ends: list[int], index: int) -> Patch:
    """Remove one of several parts that are separated by commas."""
    if index + 1 < len(starts):
        return starts[index], starts[index + 1], ""
    return (ends[index - 1] if index else starts[index]), ends[index], ""
