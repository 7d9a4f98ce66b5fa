"""What a navigator shows of its map and its plan, as reports and pages have it."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from framerunner.geometry.vectors import Vec3
from framerunner.wire.mission_report import EstimatedPlace, MapDocument, MappedFrame
from offboard.drone import PlaceEstimate
from offboard.navigation.view import GateEstimate, NavigationView

MAX_GATES = 24  # of a map: with the path some 1.5 kB compressed
MAX_POINTS = 30  # of a path
_MAX_TEXT = 80
_MM = 3  # decimals of metres; of radians one more


def map_document(
    view: NavigationView, place: PlaceEstimate | None = None, *, mission_crc: int = 0, time_us: int = 0
) -> MapDocument:
    """A navigator's map and plan, and where it is by its own estimate, as docs/monitor-channels.md has it.

    Gates without a place are left out; an unknown standard deviation is None. A path of more points than
    `MAX_POINTS` has some of them left out.
    """
    gates = [_frame(gate) for gate in view.gates if has_place(gate)]
    points = [point for point in view.path_m if all(map(isfinite, point))]
    path = tuple(_rounded(point) for point in _thinned(points))
    return MapDocument(
        mission_crc, time_us, view.goal[:_MAX_TEXT], tuple(gates[:MAX_GATES]), path, _estimated(place)
    )


def _estimated(place: PlaceEstimate | None) -> EstimatedPlace | None:
    if place is None or not all(map(isfinite, (*place.position_m, *place.position_std_m))):
        return None
    std_m, yaw_std_rad = _rounded(place.position_std_m), round(place.yaw_std_rad, _MM + 1)
    return EstimatedPlace(_rounded(place.position_m), round(place.yaw_rad, _MM + 1), std_m, yaw_std_rad)


def has_place(gate: GateEstimate) -> bool:
    """Whether a gate's position and yaw are finite."""
    return all(map(isfinite, (*gate.position_m, gate.yaw_rad)))


def _frame(gate: GateEstimate) -> MappedFrame:
    return MappedFrame(
        colour=gate.colour[:_MAX_TEXT],
        p=_rounded(gate.position_m),
        yaw=round(gate.yaw_rad, _MM + 1),
        std=_rounded(gate.position_std_m) if all(map(isfinite, gate.position_std_m)) else None,
        yaw_std=round(gate.yaw_std_rad, _MM + 1) if isfinite(gate.yaw_std_rad) else None,
        certain=gate.certain,
        ambiguous=gate.ambiguous,
        views=gate.views,
        size=(round(gate.shape.outer_width_m, _MM), round(gate.shape.outer_height_m, _MM)),
    )


def _rounded(vector: Vec3) -> Vec3:
    x, y, z = vector
    return round(x, _MM), round(y, _MM), round(z, _MM)


def _thinned(points: Sequence[Vec3]) -> Sequence[Vec3]:
    """At most `MAX_POINTS`, spread evenly, with the first and the last."""
    if len(points) <= MAX_POINTS:
        return points
    last = len(points) - 1
    return [points[round(number * last / (MAX_POINTS - 1))] for number in range(MAX_POINTS)]
