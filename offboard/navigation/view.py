"""What a navigator is told before the flight, and what it shows of its map and its plan."""

from __future__ import annotations

from dataclasses import dataclass, field

from framerunner.geometry.gate_shape import PAPER_GATE, GateShape, GateShapes
from framerunner.geometry.vectors import Vec3
from scenarios.models import Arena, Base, Camera


@dataclass(frozen=True, slots=True)
class Surroundings:
    """The arena, the base and the drone's camera; nothing about the gates but their shapes.

    With `alone` the vehicle knows its place and its heading only by the app's estimate, which it is sent.
    """

    arena: Arena
    base: Base
    camera: Camera
    shapes: GateShapes = field(default_factory=GateShapes)
    alone: bool = False


@dataclass(frozen=True, slots=True)
class GateEstimate:
    """A gate in the arena, as estimated from all images so far.

    Attributes:
        colour: red, green, blue, or the colour of a gate that is no part of the task.
        position_m: centre of the opening, arena axes.
        yaw_rad: heading of its normal, -pi/2..pi/2: a gate may be crossed from either side.
        position_std_m: standard deviations along x, y, z.
        yaw_std_rad: standard deviation of the yaw.
        ambiguous: another yaw explains the images (nearly) as well.
        certain: known well enough to fly through.
        views: how many images have been used.
        seen_us: vehicle time of the last one.
        shape: its sizes, which are known before.
    """

    colour: str
    position_m: Vec3
    yaw_rad: float
    position_std_m: Vec3
    yaw_std_rad: float
    ambiguous: bool
    certain: bool
    views: int
    seen_us: int
    shape: GateShape = PAPER_GATE


@dataclass(frozen=True, slots=True)
class NavigationView:
    """The map of gates and the plan at one time.

    Attributes:
        gates: all gates seen so far.
        path_m: points of the planned path, in order, arena axes; empty without a plan.
        goal: what the navigator does now, a word or a short phrase such as "explore" or "cross red".
        trouble: why it last could not go on, such as "red: lost from the map"; empty if it can.
    """

    gates: tuple[GateEstimate, ...] = ()
    path_m: tuple[Vec3, ...] = ()
    goal: str = ""
    trouble: str = ""
