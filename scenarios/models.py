"""Data types in arena axes: the scenario and its parts, the ground under a point, the drone's true state."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin, sqrt, tan
from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from framerunner.errors import UserError
from framerunner.files.yaml_file import refusal
from framerunner.geometry.axes import flip_quaternion
from framerunner.geometry.base_marker import FACES, BaseMarkers, MarkerFamily
from framerunner.geometry.gate_shape import BAR_LIMITS_M, PAPER_GATE, SIZE_LIMITS_M, GateShape
from framerunner.geometry.rotations import quaternion_from_euler
from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import ZERO3, Quaternion, Vec3
from scenarios.air import Wind
from scenarios.faults.declaration import Fault
from scenarios.goals import Goal
from scenarios.imaging.effects import CameraEffects, Hall, Patch
from scenarios.imaging.textures import Texture
from scenarios.part import Component, Metres, OnDrone, Part, Turn


class Gimbal(Part):
    """A gimbal with two axes that carries the camera and keeps it level: pitch and yaw are commanded."""

    pitch_min_rad: float = Field(
        -pi / 2, ge=-pi / 2, le=0, description="lowest, to the horizon; down is below 0"
    )
    pitch_max_rad: float = Field(0.52, ge=0, le=pi / 2, description="highest, to the horizon")
    yaw_max_rad: float = Field(2.79, ge=0, le=pi, description="to either side, from the drone's heading")
    rate_max_rad_s: float = Field(1.57, ge=0.01, le=20, description="at which it turns to a new angle")

    @model_validator(mode="after")
    def _turns(self) -> Self:
        if self.pitch_min_rad == self.pitch_max_rad == self.yaw_max_rad == 0.0:
            raise refusal(self.yaw_max_rad, "lets it turn about no axis; leave the gimbal out", "yaw_max_rad")
        return self


Colour = Literal["red", "green", "blue"]
COLOURS: tuple[Colour, ...] = ("red", "green", "blue")
MissionClass = Literal["contest", "open"]
"""By which limits a mission flies: the paper's, or what the drone can do. Only `contest` counts."""
DecoyColour = Literal["cyan", "magenta"]
DECOY_COLOURS: tuple[DecoyColour, ...] = ("cyan", "magenta")

_SHORTEST_DIRECTION = 1e-6
_SHORTEST_M = 0.001  # of a part of a wall; a doorway may end where the wall does
PERSON_CLEAR_M = 0.3  # from the arena to the middle of a person
START_CLEAR_M = 0.3  # from the start's centre to a pole or wall: more than half of any airframe

Radians = Annotated[float, Field(ge=-6.3, le=6.3, allow_inf_nan=False)]


ScenarioName = Annotated[
    str,
    Field(pattern=r"^[a-z0-9][a-z0-9_-]*$", max_length=80, description="small letters, digits, - and _"),
]


class ScenarioError(UserError):
    """A scenario that cannot be used; the message is one line for people."""


class Arena(Part):
    """The flying space, centred on the origin, its floor at z = 0."""

    length_x_m: float = Field(10.0, ge=0.1, le=1000, description="extent along x")
    width_y_m: float = Field(10.0, ge=0.1, le=1000, description="extent along y")
    height_m: float = Field(4.0, ge=0.1, le=1000, description="ceiling above the floor")
    margin_m: float = Field(1.0, ge=0, le=100, description="how far outside the app lets the drone fly")


class BaseMarker(Part):
    """Printed markers on the base: on top, and below the top on each side; `scenario markers` makes them."""

    family: MarkerFamily = Field("aruco_4x4", description="kind of markers; aruco_4x4 is read from farther")
    first: int = Field(0, ge=0, le=10_000, description="number of the top's; the sides have the next four")
    edge_m: float = Field(0.27, ge=0.02, le=5, description="edge of the black square")

    @property
    def markers(self) -> BaseMarkers:
        """As a camera reads them."""
        return BaseMarkers(self.family, self.first, self.edge_m)

    @model_validator(mode="after")
    def _are_in_their_family(self) -> Self:
        last = self.markers.count - FACES
        if self.first > last:
            raise refusal(self.first, f"is too large for {self.family}; use {last} or less", "first")
        return self


class Base(Part):
    """The cube the drone starts from and lands on."""

    often_unused: ClassVar = ("marker",)

    x_m: Metres = Field(0.0, description="centre")
    y_m: Metres = Field(0.0, description="centre")
    edge_m: float = Field(0.5, gt=0.1, le=10, description="edge of the square top")
    top_m: float = Field(0.51, ge=0.001, le=10, description="height of the top above the floor")
    mark_share: float = Field(
        0.7,
        ge=0,
        lt=1,
        description="edge of the brighter square on its top, as a share of the top's; 0: none",
    )
    marker: BaseMarker | None = Field(None, description="printed markers on it; by default there are none")

    @model_validator(mode="after")
    def _has_room_for_markers(self) -> Self:
        if self.marker is not None and self.marker.markers.sheet_m > min(self.edge_m, self.top_m):
            most_m = min(self.edge_m, self.top_m) * self.marker.edge_m / self.marker.markers.sheet_m
            message = f"is too large for the base with its white rim; use {most_m:.3f} or less"
            raise refusal(self.marker.edge_m, message, "marker", "edge_m")
        return self

    @property
    def solid(self) -> Solid:
        """Its box, from the floor to its top."""
        half_m = self.edge_m / 2
        return Solid("base", (self.x_m, self.y_m, self.top_m / 2), 0.0, (half_m, half_m, self.top_m / 2))


class StartPose(Part):
    """The drone's start pose; its height follows from what is under it."""

    x_m: Metres = Field(0.0, description="centre of the drone")
    y_m: Metres = Field(0.0, description="centre of the drone")
    yaw_rad: Radians = Field(0.0, description="heading, counter-clockwise from x")


_Size = Annotated[float, Field(ge=SIZE_LIMITS_M[0], le=SIZE_LIMITS_M[1])]
_Bar = Annotated[float, Field(ge=BAR_LIMITS_M[0], le=BAR_LIMITS_M[1])]


class UprightGate(Part):
    """An upright rectangular frame floating in the arena; its normal is its local x axis."""

    often_unused: ClassVar = ("depth_m",)

    colour: str
    x_m: Metres = Field(description="centre of the opening")
    y_m: Metres = Field(description="centre of the opening")
    z_m: float = Field(ge=0.01, le=100, description="centre of the opening above the floor")
    yaw_rad: Radians = Field(0.0, description="heading of its normal, counter-clockwise from x")
    outer_width_m: _Size = Field(PAPER_GATE.outer_width_m, description="horizontal, bars included")
    outer_height_m: _Size = Field(PAPER_GATE.outer_height_m, description="vertical, bars included")
    bar_m: _Bar = Field(PAPER_GATE.bar_m, description="width of the bars, seen from the front")
    depth_m: _Bar | None = Field(
        None, description="thickness of the bars, along the normal; by default bar_m"
    )

    @property
    def position_arena_m(self) -> Vec3:
        """Centre of the opening."""
        return (self.x_m, self.y_m, self.z_m)

    @property
    def shape(self) -> GateShape:
        """Its sizes."""
        depth_m = self.bar_m if self.depth_m is None else self.depth_m
        return GateShape(self.outer_width_m, self.outer_height_m, self.bar_m, depth_m)

    @property
    def opening_m(self) -> tuple[float, float]:
        """Clear width and height between the bars."""
        return self.shape.opening_m

    @property
    def hull(self) -> Solid:
        """The box around it, its opening included."""
        half_m = (self.shape.depth_m / 2, *self.shape.half_m)
        return Solid(self.colour, self.position_arena_m, self.yaw_rad, half_m)

    @model_validator(mode="after")
    def _has_opening_above_floor(self) -> Self:
        if min(self.opening_m) <= 0:
            raise refusal(self.bar_m, "leaves no opening; make it thinner or the frame larger", "bar_m")
        if self.z_m < self.outer_height_m / 2:
            raise refusal(
                self.z_m, f"sinks the frame into the floor; use {self.outer_height_m / 2} or more", "z_m"
            )
        return self


class Gate(UprightGate):
    """A frame to be crossed."""

    colour: Colour = Field(description="pure red, green or blue; crossed in this order")


class Decoy(UprightGate):
    """A frame of another colour: to cross it means nothing, to touch it is a contact."""

    colour: DecoyColour = Field(description="pure cyan or magenta")


Height = Annotated[float, Field(ge=0.01, le=1000)]


class Pole(Part):
    """A vertical pole on the floor, square in plan, its sides along the arena's axes."""

    x_m: Metres = Field(description="centre")
    y_m: Metres = Field(description="centre")
    edge_m: float = Field(0.15, ge=0.02, le=2, description="edge of its square")
    height_m: Height | None = Field(None, description="of its top above the floor; by default the ceiling's")

    def solids(self, ceiling_m: float) -> tuple[Solid, ...]:
        """Its box, up to the ceiling if it has no height of its own."""
        height_m = self.height_m or ceiling_m
        return (_standing("pole", (self.x_m, self.y_m), 0.0, (self.edge_m, self.edge_m, height_m)),)


class Doorway(Part):
    """A gap in a wall, from the floor to the wall's top."""

    offset_m: float = Field(ge=0, le=1000, description="its middle, along the wall from x_m, y_m")
    width_m: float = Field(1.2, ge=1.0, le=1000, description="of the gap")


class Wall(Part):
    """A straight wall on the floor."""

    x_m: Metres = Field(description="where it begins")
    y_m: Metres = Field(description="where it begins")
    end_x_m: Metres = Field(description="where it ends")
    end_y_m: Metres = Field(description="where it ends")
    thickness_m: float = Field(0.1, ge=0.02, le=2, description="of the wall")
    height_m: Height | None = Field(None, description="of its top above the floor; by default the ceiling's")
    doorway: Doorway | None = Field(None, description="gap in the wall; without it there is none")

    @property
    def length_m(self) -> float:
        """From end to end, doorway included."""
        return hypot(self.end_x_m - self.x_m, self.end_y_m - self.y_m)

    def solids(self, ceiling_m: float) -> tuple[Solid, ...]:
        """Its boxes, on each side of the doorway one, up to the ceiling if it has no height of its own."""
        if self.doorway is None:
            return (self._part(0.0, self.length_m, ceiling_m),)
        begin_m, end_m = _span(self.doorway)
        parts = ((0.0, begin_m), (end_m, self.length_m))
        return tuple(self._part(*part, ceiling_m) for part in parts if part[1] - part[0] > _SHORTEST_M)

    def _part(self, begin_m: float, end_m: float, ceiling_m: float) -> Solid:
        yaw_rad = atan2(self.end_y_m - self.y_m, self.end_x_m - self.x_m)
        middle_m = (begin_m + end_m) / 2
        x_m, y_m = self.x_m + middle_m * cos(yaw_rad), self.y_m + middle_m * sin(yaw_rad)
        height_m = self.height_m or ceiling_m
        return _standing("wall", (x_m, y_m), yaw_rad, (end_m - begin_m, self.thickness_m, height_m))

    @model_validator(mode="after")
    def _has_room_for_its_doorway(self) -> Self:
        if self.length_m < self.thickness_m:
            raise refusal(self.end_x_m, "makes the wall shorter than it is thick; move its end", "end_x_m")
        if self.doorway is not None:
            begin_m, end_m = _span(self.doorway)
            if begin_m < 0.0 or end_m > self.length_m:
                message = f"puts the doorway past an end of the wall, which is {self.length_m:.3g} m long"
                raise refusal(self.doorway.offset_m, message, "doorway", "offset_m")
        return self


def _span(doorway: Doorway) -> tuple[float, float]:
    """Where a doorway begins and ends, along its wall."""
    return (doorway.offset_m - doorway.width_m / 2, doorway.offset_m + doorway.width_m / 2)


def _standing(name: str, place_m: tuple[float, float], yaw_rad: float, size_m: Vec3) -> Solid:
    """A box on the floor."""
    length_m, width_m, height_m = size_m
    return Solid(name, (*place_m, height_m / 2), yaw_rad, (length_m / 2, width_m / 2, height_m / 2))


class Camera(Part):
    """A pinhole camera that looks along the drone's x axis unless it is mounted otherwise, or on a gimbal."""

    often_unused: ClassVar = ("effects", "gimbal", "mounting_frd_rad")

    width_px: int = Field(320, ge=16, le=4096, description="columns of the image")
    height_px: int = Field(240, ge=16, le=4096, description="rows of the image")
    horizontal_fov_rad: float = Field(1.57, gt=0.1, lt=3.0, description="angle of view over the width")
    rate_hz: float = Field(10.0, ge=0.1, le=120, description="images a second of simulated time")
    latency_s: float = Field(0.05, ge=0, le=2, description="from exposure to sending the image")
    position_flu_m: tuple[OnDrone, OnDrone, OnDrone] = Field(
        (0.08, 0.0, 0.0), description="in body axes forward, left, up"
    )
    mounting_frd_rad: tuple[Turn, Turn, Turn] = Field(
        (0.0, 0.0, 0.0),
        description="roll, pitch and yaw on the drone; to the right, up and to the right are positive",
    )
    near_m: float = Field(0.01, ge=0.001, le=100, description="nothing nearer is drawn")
    far_m: float = Field(20.0, ge=0.01, le=10_000, description="nothing farther is drawn")
    effects: CameraEffects | None = Field(
        None, description="what a real camera does to images; by default they are ideal"
    )

    gimbal: Gimbal | None = Field(None, description="carries the camera; by default it is fixed to the drone")

    @property
    def focal_px(self) -> float:
        """Focal length, pixels."""
        return self.width_px / 2 / tan(self.horizontal_fov_rad / 2)

    @model_validator(mode="after")
    def _sees_something(self) -> Self:
        if self.near_m >= self.far_m:
            raise refusal(self.near_m, f"must be below far_m {self.far_m}", "near_m")
        largest_rad = max(map(abs, self.mounting_frd_rad))
        if self.gimbal is not None and largest_rad > 0.0:
            raise refusal(largest_rad, "does not go with a gimbal; leave one of them out", "mounting_frd_rad")
        lens = None if self.effects is None else self.effects.lens
        half_width, half_height = self.width_px / 2 / self.focal_px, self.height_px / 2 / self.focal_px
        if lens is not None and not lens.sees_up_to(half_width, half_height):
            message = "folds the image's corners; bring k1, k2 and k3 nearer to 0 or make the view narrower"
            raise refusal(lens.k1, message, "effects", "lens", "k1")
        return self


class Light(Part):
    """One sun and ambient light."""

    often_unused: ClassVar = ("turn_rad_s",)

    sun_direction_arena: tuple[Component, Component, Component] = Field(
        (-0.5, 0.1, -0.9), description="direction of its light; any length"
    )
    ambient: float = Field(0.5, ge=0, le=1, description="brightness of surfaces in shadow")
    turn_rad_s: float = Field(
        0.0, ge=-1, le=1, description="how fast the direction turns about the upright axis, counter-clockwise"
    )

    def after(self, time_s: float) -> Light:
        """The light at a time of the flight, without its turning."""
        x, y, z = self.sun_direction_arena
        c, s = cos(self.turn_rad_s * time_s), sin(self.turn_rad_s * time_s)
        return Light(sun_direction_arena=(c * x - s * y, s * x + c * y, z), ambient=self.ambient)

    @model_validator(mode="after")
    def _sun_has_direction(self) -> Self:
        if hypot(*self.sun_direction_arena) < _SHORTEST_DIRECTION:
            message = f"has no direction; one number must be {_SHORTEST_DIRECTION} or more"
            raise refusal(str(list(self.sun_direction_arena)), message, "sun_direction_arena")
        return self


class Origin(Part):
    """Where on Earth the arena's centre is; by default PX4's simulated home."""

    latitude_deg: float = Field(47.397742, ge=-90, le=90, description="WGS 84, north positive")
    longitude_deg: float = Field(8.545594, ge=-180, le=180, description="WGS 84, east positive")
    altitude_m: float = Field(489.0, ge=-500, le=9000, description="above mean sea level")


class Scenario(Part):
    """All that is given before a flight."""

    often_unused: ClassVar = (
        "decoys",
        "poles",
        "walls",
        "sensors",
        "wind",
        "faults",
        "floor_texture",
        "hall",
        "patches",
        "gripper",
        "goals",
    )

    name: ScenarioName
    description: str = Field("", description="what this scenario is and where its numbers come from")
    arena: Arena = Field(Arena(), description="the flying space")
    base: Base = Field(Base(), description="where to land")
    start: StartPose = Field(StartPose(), description="the drone's start pose")
    frames: tuple[Gate, ...] = Field((), description="at most one of each colour, in any order")
    decoys: tuple[Decoy, ...] = Field((), description="frames that are not to be crossed, solid too")
    poles: tuple[Pole, ...] = Field((), description="obstacles that stand on the floor")
    walls: tuple[Wall, ...] = Field((), description="obstacles that stand on the floor")
    camera: Camera = Field(Camera(), description="the drone's camera")
    light: Light = Field(Light(), description="sun and sky")
    floor_texture: Texture | None = Field(
        None, description="of the floor, up to the hall's walls if there is one; by default tatami mats"
    )
    hall: Hall | None = Field(None, description="walls around the arena that are only seen")
    patches: tuple[Patch, ...] = Field((), description="flat things on the floor and on the hall's walls")
    try_limit_s: float = Field(180.0, ge=1, le=36000, description="longest try, motors on to motors off")
    airframe: str = Field("abejorro", description="name of the drone to fly")
    origin: Origin = Field(Origin(), description="where on Earth the arena is")
    gripper: bool = Field(False, description="whether the drone has one; what it holds has no mass")
    sensors: str = Field("ideal", description="name of the drone's sensor suite, or a file of one")
    wind: Wind = Field(Wind(), description="how the air moves; by default it is still")
    faults: tuple[Fault, ...] = Field((), max_length=20, description="what fails, and when")

    goals: tuple[Goal, ...] = Field(
        (), max_length=20, description="what is to be done, in this order, instead of crossing all frames"
    )

    @model_validator(mode="after")
    def _goals_have_gates(self) -> Self:
        colours = {gate.colour for gate in self.frames}
        for index, goal in enumerate(self.goals):
            if goal.face is not None and goal.face not in colours:
                message = "is the colour of no frame; add it to frames or face another"
                raise refusal(goal.face, message, "goals", index, "face")
        return self

    @model_validator(mode="after")
    def _one_gate_a_colour(self) -> Self:
        colours = [gate.colour for gate in self.frames]
        for index, colour in enumerate(colours):
            if colour in colours[:index]:
                message = "is used twice; give each frame its own colour"
                raise refusal(colour, message, "frames", index, "colour")
        return self

    @model_validator(mode="after")
    def _all_inside_arena(self) -> Self:
        arena = self.arena
        limits_m = {"x_m": arena.length_x_m / 2, "y_m": arena.width_y_m / 2}
        limits_m |= {f"end_{field}": limit_m for field, limit_m in limits_m.items()}
        for part, at in self._placed():
            for field, limit_m in limits_m.items():
                value_m: float = getattr(part, field, 0.0)
                if abs(value_m) > limit_m:
                    message = f"is outside the arena; keep within ±{limit_m} or enlarge the arena"
                    raise refusal(value_m, message, *at, field)
            for field in ("z_m", "height_m"):
                height_m: float | None = getattr(part, field, None)
                if height_m is not None and height_m > arena.height_m:
                    raise refusal(height_m, f"is above the arena; use {arena.height_m} or less", *at, field)
        return self

    @model_validator(mode="after")
    def _patches_have_walls(self) -> Self:
        if self.hall is None:
            for index, patch in enumerate(self.patches):
                if patch.surface != "floor":
                    message = "is a wall of the hall, and there is none; add hall: {} or put it on the floor"
                    raise refusal(patch.surface, message, "patches", index, "surface")
        return self

    @model_validator(mode="after")
    def _people_are_outside_the_arena(self) -> Self:
        arena, hall = self.arena, self.hall or Hall()
        for index, person in enumerate(hall.people):
            beyond_m = max(abs(person.x_m) - arena.length_x_m / 2, abs(person.y_m) - arena.width_y_m / 2)
            if not PERSON_CLEAR_M <= beyond_m <= hall.beyond_m:
                message = (
                    f"is not between arena and walls; keep it {PERSON_CLEAR_M} m or more outside the arena"
                )
                raise refusal(person.x_m, message, "hall", "people", index, "x_m")
        return self

    @model_validator(mode="after")
    def _start_and_base_are_free(self) -> Self:
        base_m = self.base.edge_m / 2 * sqrt(2.0)  # a circle around it: the message can say how far is enough
        clear = (
            ("start", self.start.x_m, self.start.y_m, START_CLEAR_M),
            ("base", self.base.x_m, self.base.y_m, base_m),
        )
        for part, at in self._placed():
            if not isinstance(part, Pole | Wall):
                continue
            for solid, (where, x_m, y_m, clear_m) in itertools.product(
                part.solids(self.arena.height_m), clear
            ):
                if solid.plan_distance_m(x_m, y_m) < clear_m:
                    message = f"is over the {where}; keep the {solid.name} {clear_m:.3g} m from its centre"
                    raise refusal(part.x_m, message, *at, "x_m")
        return self

    @property
    def contents(self) -> str:
        """What is in the arena, in words: "3 frames", and the obstacles if it has any."""
        counts = (("decoy", len(self.decoys)), ("pole", len(self.poles)), ("wall", len(self.walls)))
        others = [f", {count} {name}{'' if count == 1 else 's'}" for name, count in counts if count]
        return f"{len(self.frames)} frames{''.join(others)}"

    @property
    def all_gates(self) -> tuple[UprightGate, ...]:
        """Gates and decoys."""
        return (*self.frames, *self.decoys)

    @property
    def gate_shapes(self) -> dict[str, GateShape]:
        """The shape of each colour; of several decoys of one colour, that of the first."""
        return {gate.colour: gate.shape for gate in reversed(self.all_gates)}

    @property
    def prisms(self) -> tuple[Solid, ...]:
        """Boxes of the poles and walls: all stand on the floor."""
        obstacles: tuple[Pole | Wall, ...] = (*self.poles, *self.walls)
        return tuple(solid for obstacle in obstacles for solid in obstacle.solids(self.arena.height_m))

    @property
    def solid_names(self) -> frozenset[str]:
        """Names in `TrueState.contacts` that count as contacts: colours of gates, `pole` and `wall`."""
        gates, prisms = self.all_gates, self.prisms
        return frozenset((*(each.colour for each in gates), *(each.name for each in prisms)))

    def _placed(self) -> Iterator[tuple[Part, tuple[str | int, ...]]]:
        """All that is in the arena, with its path in the file."""
        yield self.start, ("start",)
        yield self.base, ("base",)
        for name in ("frames", "decoys", "poles", "walls"):
            for index, part in enumerate(getattr(self, name)):
                yield part, (name, index)


@dataclass(frozen=True, slots=True)
class CameraMotion:
    """How a camera on a gimbal looks and turns. Angles are kept; the rest is computed for exposures only.

    Attributes:
        pitch_rad: to the horizon, up is positive.
        yaw_ned_rad: to north, clockwise from above.
        pitch_rate_rad_s: of `pitch_rad`.
        yaw_rate_rad_s: of `yaw_ned_rad`.
    """

    pitch_rad: float
    yaw_ned_rad: float
    pitch_rate_rad_s: float
    yaw_rate_rad_s: float

    @property
    def attitude_arena(self) -> Quaternion:
        """Forward-left-up of the camera to arena axes."""
        return flip_quaternion(quaternion_from_euler(0.0, self.pitch_rad, self.yaw_ned_rad))

    @property
    def rate_frd_rad_s(self) -> Vec3:
        """Angular velocity in the camera's axes forward, right, down."""
        yaw_rate, pitch_rad = self.yaw_rate_rad_s, self.pitch_rad
        return (-yaw_rate * sin(pitch_rad), self.pitch_rate_rad_s, yaw_rate * cos(pitch_rad))


@dataclass(slots=True)
class TrueState:
    """State of the drone at one instant, simulated or from a real drone's telemetry."""

    time_us: int  # vehicle time
    position_arena_m: Vec3  # of the drone's centre
    velocity_arena_m_s: Vec3
    attitude_arena: Quaternion  # unit quaternion (w, x, y, z), body FLU to arena
    motors_on: bool
    contacts: tuple[str, ...] = ()  # what it touches: colours of gates, "pole", "wall", "base" or "floor"
    rate_frd_rad_s: Vec3 = ZERO3  # angular velocity, body axes forward, right, down; 0 if not known
    camera: CameraMotion | None = None  # of a camera on a gimbal; None: it is fixed to the drone
    crash: str = ""  # in simulation: why it cannot fly on, as the predicate to "the drone"; empty: it can


def is_over_base(base: Base, x_m: float, y_m: float) -> bool:
    """Whether a point in plan is over the base's square, border included (the base is never turned)."""
    half_m = base.edge_m / 2
    return abs(x_m - base.x_m) <= half_m and abs(y_m - base.y_m) <= half_m


def ground_height(scenario: Scenario, x_m: float, y_m: float, floor_m: float = 0.0) -> float:
    """Height of the base or floor under a point in plan, metres; the floor is at `floor_m`."""
    return scenario.base.top_m if is_over_base(scenario.base, x_m, y_m) else floor_m


def start_position(scenario: Scenario) -> Vec3:
    """Point on the base or floor under the drone's centre at the start, arena axes, metres, shape (3,)."""
    x_m, y_m = scenario.start.x_m, scenario.start.y_m
    return (x_m, y_m, ground_height(scenario, x_m, y_m))
