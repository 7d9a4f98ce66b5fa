"""Reads XML of unknown origin: bounded in size and depth, without a document type and so without entities."""

from __future__ import annotations

from dataclasses import dataclass, field
from xml.parsers import expat

from framerunner.errors import UserError

MAX_XML_BYTES = 1_000_000
MAX_ELEMENTS = 20_000
MAX_DEPTH = 60


class XmlError(UserError):
    """A file is not XML, or not of the kind that is read; one line for each fault, with its line number."""


@dataclass(slots=True)
class Element:
    """An element.

    Attributes:
        namespace: its address; empty if it has none.
        attributes: those with a namespace as "address name".
        chunks: the characters directly in it.
        line: where it begins, counted from 1.
    """

    namespace: str
    name: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)
    chunks: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """All characters directly in it."""
        return "".join(self.chunks)


def parse_xml(data: bytes) -> Element:
    """The outermost element of an XML document. Raises `XmlError`."""
    if len(data) > MAX_XML_BYTES:
        raise XmlError("the file is larger than 1 MB; a chart is a few pages")
    reader = _XmlReader()
    try:
        reader.parser.Parse(data, True)
    except expat.ExpatError as error:
        what = expat.ErrorString(error.code)
        raise XmlError(f"line {error.lineno}: not XML: {what}; correct the file") from None
    except (ValueError, LookupError) as error:  # an unknown encoding
        raise XmlError(f"cannot be read: {error}; save the file as UTF-8") from None
    assert reader.root is not None
    return reader.root


class _XmlReader:
    def __init__(self) -> None:
        self.root: Element | None = None
        self._open: list[Element] = []
        self._count = 0
        self.parser = parser = expat.ParserCreate(namespace_separator=" ")
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self._characters
        parser.StartDoctypeDeclHandler = self._refuse_document_type
        parser.buffer_text = True

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._count += 1
        line = self.parser.CurrentLineNumber
        if self._count > MAX_ELEMENTS or len(self._open) >= MAX_DEPTH:
            raise XmlError(
                f"line {line}: more than {MAX_ELEMENTS} elements, or nested deeper than {MAX_DEPTH}"
            )
        namespace, _, own = name.rpartition(" ")
        element = Element(namespace, own, attributes, line)
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)

    def _end(self, _name: str) -> None:
        self._open.pop()

    def _characters(self, text: str) -> None:
        if self._open:
            self._open[-1].chunks.append(text)

    def _refuse_document_type(self, *_: object) -> None:
        line = self.parser.CurrentLineNumber
        raise XmlError(f"line {line}: a document type (<!DOCTYPE) is not allowed; remove it")
