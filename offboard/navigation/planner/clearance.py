"""Where the drone's centre must not be: obstacles enlarged by the drone's box and a margin."""

from __future__ import annotations

from math import cos, hypot, sin

import numpy as np
import numpy.typing as npt

from framerunner.geometry.gate_shape import PAPER_GATE, GateShape
from framerunner.geometry.vectors import Vec3
from offboard.navigation.goals import FlightStyle, Obstacles, PathGate
from offboard.navigation.planner.legs import Array
from scenarios.models import Arena

DRONE_RADIUS_M = 0.177  # of its box of 0.25 x 0.25 m in plan, whatever its heading
DRONE_HALF_LENGTH_M = 0.125
DRONE_HALF_HEIGHT_M = 0.0225
TILTED_M = 0.05  # how much farther down and up its box reaches while it tilts in a turn
SAME_GATE_M = 0.4  # two gates whose centres are nearer are the same
LEAST_ROOM_SHARE = 0.4  # for which tolerances are made smaller in openings
MIDDLE_M = 0.01  # a drone that is nearer to an opening's middle plane may leave it on either side

_SPARE_M = 0.03  # how much farther than needed a detour passes
_ROUNDING_M = 1e-6

Mask = npt.NDArray[np.bool_]


class Clearance:
    """Obstacles in a fixed order: boxes (gates, then the base), columns, and the outside of the arena.

    Attributes:
        low_m: least x, y, z of the drone's centre, shape (3,).
        high_m: greatest x, y, z.
        boxes: how many of the obstacles are boxes.
        columns: how many are columns.
        base: the index of the base; -1 if there is none.
    """

    def __init__(self, obstacles: Obstacles, arena: Arena, style: FlightStyle) -> None:
        margin_m = style.side_margin_m
        x_m, y_m = arena.length_x_m / 2 - margin_m, arena.width_y_m / 2 - margin_m
        self.low_m: Array = np.array([-x_m, -y_m, style.floor_margin_m])
        self.high_m: Array = np.array([x_m, y_m, arena.height_m - margin_m])
        level_m = DRONE_RADIUS_M + style.bar_margin_m
        upright_m = DRONE_HALF_HEIGHT_M + TILTED_M + style.bar_margin_m
        rows = [
            (*gate.centre_m, cos(gate.yaw_rad), sin(gate.yaw_rad), *_gate_half_m(gate.shape, style))
            for gate in obstacles.gates
        ]
        self.base = -1
        if obstacles.base is not None:
            base, side_m = obstacles.base, obstacles.base.edge_m / 2 + level_m
            self.base = len(rows)
            rows.append(
                (base.x_m, base.y_m, base.top_m / 2, 1.0, 0.0, side_m, side_m, base.top_m / 2 + upright_m)
            )
        self.boxes = len(rows)
        self._openings_m: Array = np.array(
            [(DRONE_HALF_LENGTH_M + gate.shape.depth_m / 2, *gate.shape.half_m) for gate in obstacles.gates]
        ).reshape(-1, 3)
        self._rows: Array = np.array(rows).reshape(-1, 8)
        self._columns: Array = np.array(obstacles.columns_m).reshape(-1, 3)
        self.columns = len(self._columns)
        self._radii_m: Array = self._columns[:, 2] + level_m

    def obstacle_of(self, gate: PathGate) -> int:
        """The index of a gate among the obstacles; -1 if it is none of them."""
        gates = self.boxes - (self.base >= 0)
        if not gates:
            return -1
        distances_m = np.linalg.norm(self._rows[:gates, :3] - np.array(gate.centre_m), axis=1)
        nearest = int(distances_m.argmin())
        return nearest if distances_m[nearest] < SAME_GATE_M else -1

    @property
    def base_top_m(self) -> float:
        """The least height of the drone's centre over the base, away from take-off and landing."""
        return float(self._rows[self.base, 2] + self._rows[self.base, 7])

    def on_base(self, point_m: Array) -> bool:
        """Whether a point is over the base and lower than a flight may pass it."""
        return self.base >= 0 and bool(self.depths(point_m[None])[0, self.base] > 0.0)

    def depths(self, points_m: Array) -> Array:
        """How deep points, shape (n, 3), are in the enlarged obstacles, metres, shape (n, obstacles).

        Not above zero where a point is clear.
        """
        boxes, columns = self.boxes, self.columns
        depths = np.empty((len(points_m), boxes + columns + 1))
        # Axis by axis: NumPy reduces an axis of three numbers many times more slowly.
        if boxes:
            half_m, (u, v, w) = self._rows[:, 5:8].T, self._axis_offsets(points_m)
            aside = np.minimum(half_m[0] - np.abs(u), half_m[1] - np.abs(v))
            np.minimum(aside, half_m[2] - np.abs(w), out=depths[:, :boxes])
        if columns:
            depths[:, boxes:-1] = self.column_depths(points_m)
        x, y, z = np.maximum(self.low_m - points_m, points_m - self.high_m).T
        depths[:, -1] = np.maximum(np.maximum(x, y), z) - _ROUNDING_M
        return depths

    def column_depths(self, points_m: Array) -> Array:
        """How deep points are in the enlarged columns, in plan; shapes (n, 2 or 3) and (n, columns)."""
        squares = points_m[:, None, 0] - self._columns[:, 0]
        squares *= squares
        dy = points_m[:, None, 1] - self._columns[:, 1]
        dy *= dy
        squares += dy
        away_m: Array = np.sqrt(squares, out=squares)
        return np.subtract(self._radii_m, away_m, out=away_m)

    def line_depths(self, start_m: Array, ways_m: Array, steps_m: Array) -> tuple[Array, Array]:
        """Bounds of how deep the deepest of points along straight lines is in the enlarged columns, in plan.

        Args:
            start_m: of all lines, shape (2,).
            ways_m: from there to their ends, shape (n, 2).
            steps_m: between the points of each, whose ends need not be among them, shape (n,).

        Returns:
            Lower and upper bounds, metres, each of shape (n,).
        """
        centres = self._columns[:, :2] - start_m
        squares = np.maximum((ways_m**2).sum(axis=1, keepdims=True), _ROUNDING_M**2)
        shares = ways_m @ centres.T / squares
        aside = centres - np.clip(shares, 0.0, 1.0)[..., None] * ways_m[:, None]
        nearest_m, step_m = np.hypot(aside[..., 0], aside[..., 1]), steps_m[:, None]
        beside = (shares > 0.0) & (shares < 1.0)
        # The point that is nearest to that place is at most a step from it along the line.
        farthest_m = np.where(beside, np.hypot(nearest_m, step_m), nearest_m + step_m)
        least, greatest = self._radii_m - farthest_m, self._radii_m - nearest_m
        return least.max(axis=1, initial=-1.0), greatest.max(axis=1, initial=-1.0)

    def is_column(self, obstacle: int) -> bool:
        """Whether an index of `depths` is a column's."""
        return self.boxes <= obstacle < self.boxes + self.columns

    def offsets(self, points_m: Array) -> Array:
        """From the boxes' centres to points, in the boxes' axes, shape (n, boxes, 3)."""
        return np.stack(self._axis_offsets(points_m), axis=-1)

    def _axis_offsets(self, points_m: Array) -> tuple[Array, Array, Array]:
        """The same, each axis by itself, shape (n, boxes)."""
        x_m, y_m, z_m, c, s = self._rows[:, :5].T
        dx, dy = points_m[:, 0, None] - x_m, points_m[:, 1, None] - y_m
        return c * dx + s * dy, c * dy - s * dx, points_m[:, 2, None] - z_m

    def way_out(self, point_m: Array, next_m: Array) -> tuple[Array, Array] | None:
        """Straight out of a gate's opening, for a drone within it: where to, and the direction; else None.

        Args:
            point_m: shape (3,); the side on which it is.
            next_m: the place to go to afterwards: its side, from the middle of the opening, shape (3,).
        """
        gates = self.boxes - (self.base >= 0)
        offsets = self.offsets(point_m[None])[0, :gates]
        inside = (np.abs(offsets) < self._openings_m).all(axis=1)
        if not inside.any():
            return None
        gate = int(inside.argmax())
        row, along_m = self._rows[gate], float(offsets[gate, 0])
        normal = np.array([row[3], row[4], 0.0])
        side = along_m if abs(along_m) > MIDDLE_M else float((next_m - row[:3]) @ normal)
        out = normal if side > 0.0 else -normal
        return row[:3] + (row[5] + _SPARE_M) * out, out

    def ways_round(self, point_m: Array, velocity_m_s: Array, obstacle: int) -> list[tuple[Array, Array]]:
        """Where to pass an obstacle instead of a point in it, at which velocity; level, but for the sides.

        Args:
            point_m: inside the obstacle, shape (3,).
            velocity_m_s: there, shape (3,).
            obstacle: index of a column of `depths`.
        """
        level = np.array([velocity_m_s[0], velocity_m_s[1], 0.0])
        if obstacle >= self.boxes + self.columns:
            inside = np.clip(point_m, self.low_m + _SPARE_M, self.high_m - _SPARE_M)
            return [(inside, np.where(inside == point_m, velocity_m_s, 0.0))]
        if obstacle < self.boxes:
            row = self._rows[obstacle]
            offset = self.offsets(point_m[None])[0, obstacle]
            c, s = row[3], row[4]
            axes = (np.array([c, s, 0.0]), np.array([-s, c, 0.0]), np.array([0.0, 0.0, 1.0]))
            moves = [
                (sign * (row[5 + i] + _SPARE_M) - offset[i]) * axes[i]
                for i in (2, 1, 0)
                for sign in (1.0, -1.0)
            ]
        else:
            column = self._columns[obstacle - self.boxes]
            radius_m = self._radii_m[obstacle - self.boxes] + _SPARE_M
            across = np.array([-velocity_m_s[1], velocity_m_s[0], 0.0])
            size = float(np.hypot(across[0], across[1]))
            across = across / size if size > 1e-3 else np.array([0.0, 1.0, 0.0])
            centre = np.array([column[0], column[1], point_m[2]])
            moves = [centre + sign * radius_m * across - point_m for sign in (1.0, -1.0)]
        return [(point_m + move, level) for move in moves]


def room_share(shape: GateShape) -> float:
    """How much room the drone has in an opening, as a share of that in the challenge's; at most 1."""
    return min(max(_room_m(shape) / _room_m(PAPER_GATE), LEAST_ROOM_SHARE), 1.0)


def _room_m(shape: GateShape) -> float:
    """From the drone's box in the middle of an opening to the bars."""
    width_m, height_m = shape.opening_m
    return min(width_m / 2 - DRONE_HALF_LENGTH_M, height_m / 2 - DRONE_HALF_HEIGHT_M)


def deeper_m(shape: GateShape) -> float:
    """By how much farther from its middle a gate's bars reach, along its normal, than the challenge's."""
    return max((shape.depth_m - PAPER_GATE.depth_m) / 2, 0.0)


def gate_reach_m(shape: GateShape, style: FlightStyle) -> float:
    """How far from its centre an enlarged gate reaches."""
    return hypot(*_gate_half_m(shape, style))


def _gate_half_m(shape: GateShape, style: FlightStyle) -> Vec3:
    """Half the size of an enlarged gate: thickness, width and height."""
    level_m = DRONE_RADIUS_M + style.bar_margin_m
    upright_m = DRONE_HALF_HEIGHT_M + TILTED_M + style.bar_margin_m
    half_width_m, half_height_m = shape.half_m
    return (shape.depth_m / 2 + level_m, half_width_m + level_m, half_height_m + upright_m)
