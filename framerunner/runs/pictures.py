"""Pictures for people: a scenario from above, and where a flight went.

`framerunner.runs.drawing` draws, imported only when a picture is made: matplotlib takes a second.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from errors import UserError
from framerunner.runs.track import Track
from scenarios.models import Scenario
from scenarios.result import FlightResult

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")


class PictureError(UserError):
    """A picture that cannot be made; the message is one line for people."""


def scenario_picture(scenario: Scenario, path: Path) -> None:
    """Draw a scenario from above and from the side: floor, base, start and frames with their heights.

    Args:
        scenario: what to draw.
        path: the file to write; its suffix, one of `SUFFIXES`, says the format.

    Raises:
        PictureError: the suffix is not known, or the file cannot be written.
    """
    _check_suffix(path)
    from framerunner.runs.drawing import draw_scenario

    _save(draw_scenario(scenario), path)


def track_picture(scenario: Scenario, track: Track, result: FlightResult | None, path: Path) -> None:
    """Draw a flight from above and from the side, its path coloured by the mission's state.

    Args:
        scenario: what was flown.
        track: where the drone was; may be empty.
        result: None if nobody judged the flight.
        path: the file to write; its suffix, one of `SUFFIXES`, says the format.

    Raises:
        PictureError: the suffix is not known, or the file cannot be written.
    """
    _check_suffix(path)
    from framerunner.runs.drawing import draw_track

    _save(draw_track(scenario, track, result), path)


def _check_suffix(path: Path) -> None:
    if path.suffix.lower() not in SUFFIXES:
        raise PictureError(f"picture: '{path}' has no known format; name it {', '.join(SUFFIXES)}")


def _save(figure: Figure, path: Path) -> None:
    try:
        figure.savefig(path)
    except OSError as error:
        raise PictureError(f"picture: cannot write '{path}': {error.strerror or error}") from error
