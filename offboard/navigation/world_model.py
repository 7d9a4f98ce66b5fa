"""What the navigator knows of the arena: gates, obstacles, and what has not been seen yet."""

from __future__ import annotations

from collections import deque
from collections.abc import Container, Sequence
from dataclasses import replace
from math import dist, hypot, inf
from typing import TypeAlias

from framerunner.geometry.axes import Pose
from framerunner.geometry.vectors import Vec3
from offboard.drone import DroneState
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.exploration import Explorer, Pace
from offboard.navigation.gates.gate_map import GateMap
from offboard.navigation.goals import FlightStyle, Obstacles, PathGate
from offboard.navigation.obstacle_map import ObstacleMap
from offboard.navigation.planner.clearance import DRONE_RADIUS_M
from offboard.navigation.pose_history import DronePose, PoseCorrection, PoseHistory
from offboard.navigation.search.likelihood import Glimpses
from offboard.navigation.seen_space import SeenSpace, ViewedSpace
from offboard.navigation.view import GateEstimate, Surroundings
from offboard.place.base_landmark import BaseLandmark
from offboard.place.flight_axes import AT_GATE_M, NEAR_M, FlightAxes
from offboard.place.place import PlaceEstimator
from scenarios.models import COLOURS
from vision.types import BaseExpectation, Detections

START_SPARE_M = 0.02  # by which what is known to be free at the start exceeds what the drone needs
IMAGES_WAITING = 32  # for the drone's pose when they were exposed

_Places: TypeAlias = tuple[Vec3, dict[str, Vec3]]  # of the drone and the gates, arena axes


class WorldModel:
    """Everything seen so far, in arena axes. Images are used at the drone's pose when they were exposed.

    Attributes:
        seen_space: where nothing stands.
        viewed_space: where a gate would have been seen.
    """

    def __init__(self, surroundings: Surroundings, style: FlightStyle) -> None:
        camera = self._camera = CameraModel.of(surroundings.camera)
        self._surroundings = surroundings
        self._history = PoseHistory(camera)
        self._place = PlaceEstimator(camera, surroundings.shapes, alone=surroundings.alone)
        self._axes = FlightAxes()
        self._near = ""  # colour of the gate that the drone is flown by
        self._axes_us: int | None = None
        self._base = BaseLandmark(camera, surroundings.base)
        self._map = GateMap(camera, surroundings.arena, surroundings.shapes)
        self._obstacle_map = ObstacleMap(camera, surroundings.arena)
        self.seen_space = SeenSpace(camera, surroundings.arena)
        self.viewed_space = ViewedSpace(camera, surroundings.base, surroundings.shapes)
        self._glimpses = Glimpses(camera, surroundings.shapes)
        self._explorer = Explorer(camera, surroundings.arena, Pace.of(style), surroundings.shapes)
        self._start_m: Vec3 | None = None
        self._start_room_m = DRONE_RADIUS_M + style.bar_margin_m + START_SPARE_M
        self._image_us = -1
        self._waiting: deque[Detections] = deque(maxlen=IMAGES_WAITING)
        self._known: dict[str, GateEstimate] = {}  # by colour
        self._in_flight: dict[str, GateEstimate] = {}  # likewise, in the axes of flight
        self._gates: tuple[PathGate, ...] | None = None  # that a path must keep clear of; None: not made yet

    def observe(self, state: DroneState, images: Sequence[Detections]) -> DroneState:
        """Add the state of a tick and what was seen in the images since the last one.

        Images that are repeated or have no time are ignored. One that is newer than the state waits for the
        state after it; one from a time of which no states are known is lost.

        Returns:
            The state now, by all that is known.
        """
        self._place.add(state)
        before = self._place.places_m(state.time_us)
        if self._start_m is None:
            self._start_m = (state.x, state.y, state.z)
        for earlier in state.missed:
            self._history.add(earlier)
        self._history.add(state)
        for image in images:
            if image.time_us is not None and image.time_us > self._image_us:
                self._image_us = image.time_us
                self._waiting.append(image)
        waiting = self._waiting
        read_us = state.time_us - round(0.5e6 * self._camera.readout_s)  # images are read out by now
        while waiting and (image_us := waiting[0].time_us) is not None and image_us <= read_us:
            is_there = self._place.advance(image_us)
            correction = self._place.correction(image_us)
            pose = self._history.at(image_us, correction)
            image = waiting.popleft()
            if pose is not None:
                self._use(image, pose, correction if is_there else None)
        self._place.advance()
        after = self._place.places_m(state.time_us)
        if before is not None and after is not None:
            self._move_axes(before, after, state.time_us)
            self._know(after[1])
        return self._place.state(state)

    def _move_axes(self, before: _Places, after: _Places, time_us: int) -> None:
        """Let the axes of flight take in by what this tick has corrected the place."""
        step_s = 0.0 if self._axes_us is None else (time_us - self._axes_us) * 1e-6
        (drone_m, gates_m), (drone_after_m, gates_after_m) = before, after
        gate_m, gate_after_m = gates_m.get(self._near), gates_after_m.get(self._near)
        jump, away_m = _minus(drone_after_m, drone_m), inf
        if gate_m is not None and gate_after_m is not None:
            away_m = dist(drone_after_m, gate_after_m)
            jump = _minus(gate_after_m, gate_m) if away_m < AT_GATE_M else jump
        self._axes.jump(jump, step_s, held=away_m < NEAR_M)
        self._axes_us, self._near = time_us, ""

    def stay_by(self, colour: str) -> None:
        """The drone is flown by a gate at this tick: see `FlightAxes`."""
        self._near = colour

    def in_flight(self, state: DroneState) -> DroneState:
        """The drone's state in the axes of flight, which are the arena's if the vehicle knows its place."""
        if not any(self._axes.offset_m):
            return state
        x, y, z = self._axes.of((state.x, state.y, state.z))
        return replace(state, x=x, y=y, z=z)

    def _know(self, in_filter: Container[str]) -> None:
        """Note what is known of each gate now, relative to the drone."""
        best = [estimate for estimate in map(self._map.best, COLOURS) if estimate is not None]
        self._known = {estimate.colour: self._place.known(estimate) for estimate in best}
        in_flight = {
            colour: replace(known, position_m=self._axes.of(known.position_m))
            if colour in in_filter
            else known
            for colour, known in self._known.items()
        }
        if in_flight != self._in_flight:
            self._in_flight, self._gates = in_flight, None

    @property
    def velocity_error_flu_m_s(self) -> Vec3:
        """See `PlaceEstimator.velocity_error_flu_m_s`."""
        return self._place.velocity_error_flu_m_s

    def _use(self, image: Detections, pose: DronePose, correction: PoseCorrection | None) -> None:
        """Use an image.

        Args:
            image: what it showed.
            pose: of the drone when it was exposed.
            correction: of that pose, if the image can correct the drone's place.
        """
        position_m, attitude = pose.position_m, pose.attitude_arena
        self._gates = None
        poses = self._poses_of_rows(image, pose)
        self._map.observe(image, pose, poses)
        if correction is not None:
            poses = [pose] * len(image.frames) if poses is None else poses
            self._place.see(image.frames, poses, correction, self._map)
            self._see_base(image, pose, correction)
            after = self._place.correction(pose.time_us)  # gates and base may have changed it
            if image.tracks is not None and after is not None:
                rows = (self._pose_of_row(row_px, pose) for row_px in (-inf, 0.0, inf))
                self._place.see_tracks(image.tracks, [each or pose for each in rows], after)
        self._obstacle_map.update(position_m, attitude, image.obstacle_edges)
        self.seen_space.update(position_m, attitude, image.obstacle_edges)
        self._explorer.coverage.update(position_m, attitude, image.obstacle_edges)
        known = [colour for colour in COLOURS if self._map.best(colour) is not None]
        self.viewed_space.update(self._camera.pose(position_m, attitude))
        others = any(gate.colour not in COLOURS for gate in self._map.gates)
        self.viewed_space.needed = others or len(known) < len(COLOURS)
        self._glimpses.update(position_m, attitude, image, known, self._map.is_lookalike)

    def _pose_of_row(self, down_px: float, pose: DronePose) -> DronePose | None:
        """The drone's pose when a row of an image was read out; None if the states around it are missing."""
        at_us = pose.time_us + round(1e6 * self._camera.read_after_s(down_px))
        return self._history.at(at_us, self._place.correction(at_us))

    def _see_base(self, image: Detections, pose: DronePose, correction: PoseCorrection) -> None:
        sighting, base = image.base, self._base
        correction = self._place.correction(pose.time_us) or correction  # gates may have changed it
        if sighting is None:
            return
        pose = self._pose_of_row(base.row_px(sighting), pose) or pose
        if self._place.see_points(base.points_m(sighting), sighting, pose, correction):
            base.seen_us.append(pose.time_us)

    def expected_base(self, time_us: int) -> BaseExpectation | None:
        """Where the base is to be looked for in an image; None if it need not be, or is out of view."""
        std = self._place.std
        pose = None if std is None else self._history.at(time_us, self._place.correction(time_us))
        return None if std is None or pose is None else self._base.expected(pose, std)

    def base_known(self, since_us: int) -> tuple[int, float] | None:
        """How often the base was seen since a time, and how well the place is known in plan, metres.

        None: the vehicle knows its place, so the base need not be looked at.
        """
        std = self._place.std
        return None if std is None else (self._base.sightings(since_us), float(std[:2].max()))

    def doubt_place(self) -> None:
        """See `PlaceEstimator.doubt`."""
        self._place.doubt()

    def _poses_of_rows(self, image: Detections, pose: DronePose) -> list[DronePose] | None:
        """With a rolling shutter, the drone's pose when each gate's middle row was read out."""
        if self._camera.readout_s == 0.0:
            return None
        poses = []
        for sighting in image.frames:
            rows = [corner.down_px for corner in sighting.corners if corner is not None]
            at = self._pose_of_row(sum(rows) / len(rows) if rows else 0.0, pose)
            poses.append(pose if at is None else replace(at, time_us=pose.time_us))
        return poses

    def gate(self, colour: str) -> GateEstimate | None:
        """The gate of a colour in the axes of flight; None if it is not on the map."""
        known = self._map.best(colour)
        return known if known is None else self._in_flight.get(colour, known)

    @property
    def gates(self) -> tuple[GateEstimate, ...]:
        """All gates on the map, in the arena."""
        return tuple(
            self._known.get(gate.colour, gate) if gate is self._map.best(gate.colour) else gate
            for gate in self._map.gates
        )

    def gate_of(self, gate: GateEstimate) -> PathGate:
        """A gate as a path crosses it: in the arena, also while it seems to be outside, seen from afar."""
        arena = self._surroundings.arena
        half_m = gate.shape.outer_height_m / 2
        x_m, y_m = arena.length_x_m / 2, arena.width_y_m / 2
        x, y, z = gate.position_m
        inside = (
            min(max(x, -x_m), x_m),
            min(max(y, -y_m), y_m),
            min(max(z, half_m), arena.height_m - half_m),
        )
        return PathGate(inside, gate.yaw_rad, gate.shape)

    def obstacles(self) -> Obstacles:
        """All that a path must keep clear of; of each colour of the task only the gate known best."""
        if self._gates is None:
            seen = [gate for gate in self._map.gates if gate.colour not in COLOURS]
            seen += [best for best in map(self.gate, COLOURS) if best is not None]
            self._gates = tuple(map(self.gate_of, seen))
        return Obstacles(self._gates, self._columns_m(), self._surroundings.base)

    def next_viewpoint(self, position_m: Vec3, yaw_rad: float, *, from_here: bool = True) -> Pose:
        """Where to look next for gates that are not on the map; see `Explorer.next_viewpoint`."""
        return self._explorer.next_viewpoint(
            position_m,
            yaw_rad,
            [gate.position_m for gate in self.gates],
            self._glimpses.lines(),
            self._columns_m(),
            from_here=from_here,
        )

    def refuse_viewpoint(self) -> None:
        """No way was found to the viewpoint chosen last."""
        self._explorer.refuse()

    def _columns_m(self) -> tuple[Vec3, ...]:
        """What stands on the floor; where the drone took off, there is room for it."""
        columns_m = self._obstacle_map.columns_m + self.seen_space.suspects_m
        start_m = self._start_m
        if start_m is None:
            return columns_m
        gaps_m = [hypot(x - start_m[0], y - start_m[1]) - self._start_room_m for x, y, _ in columns_m]
        return tuple(
            (x, y, min(radius_m, gap_m))
            for (x, y, radius_m), gap_m in zip(columns_m, gaps_m, strict=True)
            if gap_m > 0.0
        )


def _minus(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])
