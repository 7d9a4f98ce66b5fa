"""A mission's document: its text, what the text says, and what is wrong with it."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from framerunner.files.text_file import TextError, decode_text, read_bytes
from framerunner.files.yaml_text import ListNode, MapNode, Node, Place, Scalar
from offboard.authoring.outline import Outline
from offboard.authoring.text import MissionText, Positions
from offboard.chart.mission_texts import Message
from offboard.chart.problems import MissionError, ProblemList, mission_error
from offboard.chart.read import parse_mission_yaml, read_nodes
from offboard.chart.spec import MissionFile, expand, merge_extended
from offboard.mission import MAX_FILE_BYTES, BaseReader, read_base, unreadable


@dataclass(frozen=True)
class Document:
    """A mission file in an editor. Any text is a document, also one that is no mission.

    Attributes:
        content: the text, with the file's line ends.
        path: of the file, which need not exist; what it extends is looked for beside it.
        open_base: reads what it extends; `read_package_base` if it may not be another file of the folder.
    """

    content: MissionText
    path: Path
    open_base: BaseReader = read_base

    @classmethod
    def from_text(cls, text: str, path: str | Path = "mission.yaml") -> Document:
        """A document with a text, such as that of a new file."""
        return cls(MissionText.of(text), Path(path))

    @classmethod
    def from_bytes(cls, data: bytes, path: str | Path) -> Document:
        """A document with a file's content. Raises `MissionError` if it is too large or not UTF-8."""
        if len(data) > MAX_FILE_BYTES:
            raise mission_error(Place(Path(path).name), Message("file.too_large"))
        try:
            decode_text(data)
        except TextError as error:
            raise unreadable(Path(path).name, error) from None
        return cls(MissionText.of(data.decode("utf-8")), Path(path))  # with its mark and line ends

    @classmethod
    def open(cls, path: str | Path) -> Document:
        """Read a file. Raises `MissionError` if it cannot be read, is too large or is not UTF-8."""
        try:
            return cls.from_bytes(read_bytes(path, MAX_FILE_BYTES), path)
        except TextError as error:
            raise unreadable(Path(path).name, error) from None

    @property
    def data(self) -> bytes:
        """What is written to the file: of an opened document that was not changed, the same bytes."""
        return self.content.written.encode("utf-8")

    @property
    def text(self) -> str:
        """The text, its lines ended by a line feed; all offsets count its characters."""
        return self.content.text

    @property
    def label(self) -> str:
        """The file's name, as findings have it."""
        return self.path.name

    @cached_property
    def positions(self) -> Positions:
        """Converts offsets to lines and columns."""
        return Positions(self.text)

    @cached_property
    def _parsed(self) -> MapNode | MissionError:
        try:
            return parse_mission_yaml(self.text, self.label)
        except MissionError as error:
            return error

    @property
    def nodes(self) -> MapNode | None:
        """The nodes of its YAML; None if it is empty or cannot be read."""
        return self._parsed if isinstance(self._parsed, MapNode) else None

    @cached_property
    def _scalars(self) -> tuple[list[int], list[Scalar]]:
        """All texts of its YAML in their order, with where they start."""
        found: list[Scalar] = []
        pending: list[Node] = [] if self.nodes is None else [self.nodes]
        while pending:
            node = pending.pop()
            if isinstance(node, Scalar):
                found.append(node)
            elif isinstance(node, ListNode):
                pending.extend(node.items)
            elif isinstance(node, MapNode):
                pending.extend((*node.key_nodes.values(), *node.items.values()))
        found.sort(key=lambda scalar: (scalar.start, scalar.end))
        return [scalar.start for scalar in found], found

    def scalar_at(self, offset: int) -> Scalar | None:
        """The text of its YAML around an offset."""
        starts, scalars = self._scalars
        number = bisect_right(starts, offset) - 1
        return scalars[number] if number >= 0 and offset < scalars[number].end else None

    @property
    def unreadable(self) -> MissionError | None:
        """Why it is not YAML; None if it is, or is empty. Only its text can be edited then."""
        error = self._parsed
        if isinstance(error, MapNode) or error.problems[0].message.code == "yaml.empty":
            return None
        return error

    @cached_property
    def outline(self) -> Outline:
        """Where its states are; an empty one if it cannot be read."""
        return Outline(self.nodes)

    @cached_property
    def base(self) -> MissionFile | None:
        """The mission that it extends, with those that this one extends; None if there is none to read."""
        if not self.outline.text("extends"):
            return None
        try:
            return merge_extended(self.open_base(self._written()), self.open_base)
        except MissionError:
            return None

    @cached_property
    def chart(self) -> MissionFile | None:
        """The expanded chart, as far as it can be understood; None if it cannot."""
        if self.nodes is None:
            return None
        try:
            problems = ProblemList()
            written = self._written()
            try:
                merged = merge_extended(written, self.open_base)
            except MissionError:
                merged = written
            return expand(merged, problems)
        except MissionError:
            return None

    @cached_property
    def _read(self) -> tuple[MissionFile, ProblemList]:
        assert self.nodes is not None
        problems = ProblemList()
        return read_nodes(self.nodes, self.path, problems), problems

    def _written(self) -> MissionFile:
        return self._read[0]

    def read(self) -> MissionFile:
        """What it says, without what it extends. Raises `MissionError` with all faults of its form."""
        if isinstance(self._parsed, MissionError):
            raise self._parsed
        written, problems = self._read
        problems.raise_if_any()
        return written
