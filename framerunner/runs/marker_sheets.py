"""The markers on a scenario's base as pages to be printed, true to size.

Import this late, as `plots`.
"""

from __future__ import annotations

from pathlib import Path

from matplotlib import rc_context
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from framerunner.errors import SettingError, write_advice
from framerunner.geometry.base_marker import BaseMarkers, MarkedFace
from framerunner.geometry.marker_cells import white_parts
from scenarios.models import Scenario

_PAPER_MM = {"A4": (210, 297), "A3": (297, 420), "A2": (420, 594), "A1": (594, 841), "A0": (841, 1189)}
_MARGIN_MM = 6.0  # which printers leave white
_WORDS_MM = 46.0  # height of the words below the sheet
_LINE_MM = 8.0
_RULER_MM = 100.0
_MM_PER_INCH = 25.4


def write_marker_sheets(scenario: Scenario, path: Path) -> int:
    """Write a PDF file with a page for each face of the base; how many there are.

    Raises:
        SettingError: the scenario's base has no markers, or the file cannot be written.
    """
    figures = marker_sheets(scenario)
    try:
        with rc_context({"pdf.fonttype": 42}), PdfPages(path, metadata={"CreationDate": None}) as pages:
            for figure in figures:
                pages.savefig(figure)
    except OSError as error:
        raise SettingError(f"{path}: cannot be written ({error.strerror}); {write_advice(error)}") from error
    return len(figures)


def marker_sheets(scenario: Scenario) -> list[Figure]:
    """The pages.

    Raises:
        SettingError: the scenario's base has no markers.
    """
    base = scenario.base
    if base.marker is None:
        raise SettingError(
            f"scenario '{scenario.name}': its base has no markers; write `base: {{marker: {{}}}}` "
            "into its file"
        )
    markers = base.marker.markers
    return [_page(scenario, markers, face) for face in markers.faces(base.edge_m, base.top_m)]


def _page(scenario: Scenario, markers: BaseMarkers, face: MarkedFace) -> Figure:
    sheet_mm = 1e3 * markers.sheet_m
    paper, (width_mm, height_mm) = _paper_for(sheet_mm)
    figure = Figure(figsize=(width_mm / _MM_PER_INCH, height_mm / _MM_PER_INCH))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, width_mm), ylim=(0.0, height_mm))
    axes.set_axis_off()
    x_mm, y_mm = width_mm / 2, height_mm - _MARGIN_MM - sheet_mm / 2  # of the marker's centre
    cut_at = (x_mm - sheet_mm / 2, y_mm - sheet_mm / 2)
    axes.add_patch(Rectangle(cut_at, sheet_mm, sheet_mm, fill=False, edgecolor="0.6", linewidth=0.5))
    half_m = markers.edge_m / 2
    parts = [((-half_m, half_m, -half_m, half_m), "black")]
    parts += [(part, "white") for part in white_parts(markers, face.number)]
    for (left_m, right_m, lower_m, upper_m), colour in parts:
        corner = (x_mm + 1e3 * left_m, y_mm + 1e3 * lower_m)
        wide_mm, high_mm = 1e3 * (right_m - left_m), 1e3 * (upper_m - lower_m)
        axes.add_patch(
            Rectangle(corner, wide_mm, high_mm, facecolor=colour, linewidth=0.0, antialiased=False)
        )
    top_mm = y_mm - sheet_mm / 2 - _LINE_MM
    words = (
        f"framerunner, base of scenario {scenario.name}: {face.name}",
        f"{markers.family} number {face.number}, black square {1e3 * markers.edge_m:.0f} mm, cut to "
        f"{sheet_mm:.0f} mm; paper {paper}",
        _where(face),
        f"Print at 100 %, not fitted to the page: this line must be {_RULER_MM:.0f} mm long.",
    )
    for number, text in enumerate(words):
        axes.text(_MARGIN_MM, top_mm - number * _LINE_MM, text, fontsize=9, va="center")
    ruler_mm = top_mm - len(words) * _LINE_MM
    axes.plot((_MARGIN_MM, _MARGIN_MM + _RULER_MM), (ruler_mm, ruler_mm), "|-", color="black", linewidth=0.8)
    return figure


def _where(face: MarkedFace) -> str:
    """Where the sheet belongs, for people."""
    if face.name == "top":
        return "Glue it on the middle of the top; this sheet's upper edge looks along the arena's x axis."
    axis = face.name.removesuffix(" side")
    return f"Glue it on the side that looks along the arena's {axis}, in its middle, directly below the top."


def _paper_for(sheet_mm: float) -> tuple[str, tuple[float, float]]:
    """Name and size of the smallest paper that has room."""
    wide_mm, high_mm = sheet_mm + 2 * _MARGIN_MM, sheet_mm + 2 * _MARGIN_MM + _WORDS_MM
    for name, (width_mm, height_mm) in _PAPER_MM.items():
        if wide_mm <= width_mm and high_mm <= height_mm:
            return name, (width_mm, height_mm)
    return "of its own size", (wide_mm, high_mm)
