"""Makes the MAP documents of a flight: what the navigator shows of its map and its plan, as JSON."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from typing import Any

from offboard.app import Moment
from offboard.navigation.view import FrameEstimate, NavigationView

PERIOD_US = 500_000  # of vehicle time between two documents
MAX_FRAMES = 24  # of a map: with the path some 1.5 kB compressed
MAX_POINTS = 30  # of a path
_MAX_TEXT = 80
_MM = 3  # decimals of metres; of radians one more

Json = dict[str, Any]


class NavigationReporter:
    """Decides at each tick whether there is news to report."""

    def __init__(self) -> None:
        self._reported: Json | None = None
        self._reported_us = 0

    def document(self, moment: Moment) -> Json | None:
        """The document to send now; None if nothing has changed, or the last one was sent just before."""
        view, time_us = moment.navigation, moment.state.time_us
        if view is None or (self._reported is not None and time_us - self._reported_us < PERIOD_US):
            return None
        content = navigation_json(view)
        if content == self._reported:
            return None
        self._reported, self._reported_us = content, time_us
        return {"time_us": time_us, **content}


def navigation_json(view: NavigationView) -> Json:
    """A navigator's map and plan, as docs/monitor-channels.md has it.

    Frames without a place are left out; an unknown standard deviation is null. A path of more points than
    `MAX_POINTS` has some of them left out.
    """
    frames = [_frame_json(frame) for frame in view.frames if _has_place(frame)]
    points = [point for point in view.path_m if all(map(isfinite, point))]
    return {
        "goal": view.goal[:_MAX_TEXT],
        "frames": frames[:MAX_FRAMES],
        "path": [_rounded(point) for point in _thinned(points)],
    }


def _has_place(frame: FrameEstimate) -> bool:
    return all(map(isfinite, (*frame.position_m, frame.yaw_rad)))


def _frame_json(frame: FrameEstimate) -> Json:
    return {
        "colour": frame.colour[:_MAX_TEXT],
        "p": _rounded(frame.position_m),
        "yaw": round(frame.yaw_rad, _MM + 1),
        "std": _rounded(frame.position_std_m) if all(map(isfinite, frame.position_std_m)) else None,
        "yaw_std": round(frame.yaw_std_rad, _MM + 1) if isfinite(frame.yaw_std_rad) else None,
        "certain": frame.certain,
        "ambiguous": frame.ambiguous,
        "views": frame.views,
    }


def _rounded(values: Sequence[float]) -> list[float]:
    return [round(value, _MM) for value in values]


def _thinned(points: list[tuple[float, float, float]]) -> list[tuple[float, float, float]]:
    """At most `MAX_POINTS`, spread evenly, with the first and the last."""
    if len(points) <= MAX_POINTS:
        return points
    last = len(points) - 1
    return [points[round(number * last / (MAX_POINTS - 1))] for number in range(MAX_POINTS)]
