"""The flight card as a PDF of A4 pages. Import this late: matplotlib takes a second."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from textwrap import wrap

from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure

from framerunner.wire.operator_messages import CardSection

_PAGE_IN = (8.27, 11.69)
_TOP, _BOTTOM, _LEFT = 0.96, 0.04, 0.06
_LINE = 0.0125  # height of a line of text, share of the page
_WIDTHS = {2: (26, 88), 3: (26, 44, 40), 5: (20, 9, 40, 22, 28)}
"""Characters of each column, by the number of columns."""
_CHARACTER = 0.0078  # width of a character, share of the page
_COLOURS = {"FAIL": "#b00020", "accepted": "#8a6100", "note": "#8a6100"}
_TEXT_PT, _HEAD_PT, _TITLE_PT = 7.2, 9.5, 14.0

_Line = tuple[str, float, tuple[str, ...], str]
"""What it is, its height, its cells and their colour."""


def write_pdf(title: str, sections: Sequence[CardSection], path: Path) -> None:
    """Write a card of some tables. Raises OSError."""
    with PdfPages(path, metadata={"Title": title}) as pages:
        figure, at = Figure(figsize=_PAGE_IN), _TOP
        figure.text(_LEFT, at - 0.02, title, fontsize=_TITLE_PT, weight="bold", parse_math=False)
        at -= 0.05
        for line in (line for section in sections for line in _lines(section)):
            kind, height, cells, colour = line
            if at - height < _BOTTOM:
                pages.savefig(figure)
                figure, at = Figure(figsize=_PAGE_IN), _TOP
            at -= height
            size, weight = (_HEAD_PT, "bold") if kind == "title" else (_TEXT_PT, "normal")
            x = _LEFT
            for cell, width in zip(cells, _WIDTHS.get(len(cells), (100,)), strict=False):
                figure.text(
                    x,
                    at,
                    cell,
                    fontsize=size,
                    weight=weight,
                    color=colour,
                    family="sans-serif",
                    parse_math=False,
                )
                x += width * _CHARACTER
        pages.savefig(figure)


def _lines(section: CardSection) -> Iterator[_Line]:
    yield "title", 2.0 * _LINE, (section.title,), "black"
    widths = _WIDTHS[len(section.rows[0].cells)]
    for row, cells in zip(section.rows, _wrapped_rows(section, widths), strict=True):
        colour = _COLOURS.get(row.cells[1], "black") if len(row.cells) == 5 else "black"
        for number in range(max(map(len, cells))):
            texts = tuple(cell[number] if number < len(cell) else "" for cell in cells)
            yield "row", (1.25 if number == 0 else 1.0) * _LINE, texts, colour


def _wrapped_rows(section: CardSection, widths: Sequence[int]) -> list[tuple[list[str], ...]]:
    """A section's rows with each cell broken into lines of at most a column's width in characters."""
    return [
        tuple(wrap(cell, width) or [""] for cell, width in zip(row.cells, widths, strict=False))
        for row in section.rows
    ]
