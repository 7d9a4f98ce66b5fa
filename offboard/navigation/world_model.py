"""What the navigator knows of the arena: gates, obstacles, and what has not been seen yet."""

from __future__ import annotations

from collections import deque
from collections.abc import Container, Sequence
from math import cos, hypot, sin

from framerunner.geometry.axes import Pose
from framerunner.geometry.vectors import Vec3
from offboard.drone import DroneState
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.exploration import Explorer, Pace
from offboard.navigation.gates.gate_map import GateMap
from offboard.navigation.goals import FlightStyle, Obstacles, PathGate
from offboard.navigation.obstacle_map import ObstacleMap
from offboard.navigation.planner.clearance import DRONE_RADIUS_M, deeper_m
from offboard.navigation.planner.route import LEAST_STRAIGHT_M
from offboard.navigation.search.likelihood import Glimpses
from offboard.navigation.seen_space import SeenSpace, ViewedSpace
from offboard.navigation.view import GateEstimate, Surroundings
from offboard.place.localization import ImagePose, Localization
from scenarios.models import COLOURS, Arena
from vision.types import Detections

START_SPARE_M = 0.02  # by which what is known to be free at the start exceeds what the drone needs
SIDES_SPARE_M = 0.1  # beside the least room that a path through a gate needs
SIDES_STD = 3.0  # of the place, by which the arena's sides may be farther away than they seem
IMAGES_WAITING = 32  # for the drone's pose when they were exposed


class WorldModel:
    """Everything seen so far, in arena axes. Images are used at the drone's pose when they were exposed.

    Attributes:
        localization: where the drone is.
        seen_space: where nothing stands.
        viewed_space: where a gate would have been seen.
    """

    def __init__(self, surroundings: Surroundings, style: FlightStyle) -> None:
        camera = self._camera = CameraModel.of(surroundings.camera)
        self._surroundings, self._style = surroundings, style
        self.localization = Localization(surroundings)
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
        localization = self.localization
        localization.add(state)
        if self._start_m is None:
            self._start_m = (state.x, state.y, state.z)
        for image in images:
            if image.time_us is not None and image.time_us > self._image_us:
                self._image_us = image.time_us
                self._waiting.append(image)
        waiting = self._waiting
        read_us = state.time_us - round(0.5e6 * self._camera.readout_s)  # images are read out by now
        while waiting and (image_us := waiting[0].time_us) is not None and image_us <= read_us:
            image, at = waiting.popleft(), localization.pose_of(image_us)
            if at is not None:
                self._use(image, at)
        in_filter = localization.finish(state.time_us)
        if in_filter is not None:
            self._know(in_filter)
        return localization.state(state)

    def _know(self, in_filter: Container[str]) -> None:
        """Note what is known of each gate now, relative to the drone."""
        best = [estimate for estimate in map(self._map.best, COLOURS) if estimate is not None]
        self._known = {estimate.colour: self.localization.known(estimate) for estimate in best}
        in_flight = {
            colour: self.localization.gate_in_flight(known) if colour in in_filter else known
            for colour, known in self._known.items()
        }
        if in_flight != self._in_flight:
            self._in_flight, self._gates = in_flight, None

    def _use(self, image: Detections, at: ImagePose) -> None:
        position_m, attitude = at.pose.position_m, at.pose.attitude_arena
        self._gates = None
        poses = self.localization.poses_of_rows(image, at.pose)
        self._map.observe(image, at.pose, poses)
        self.localization.use(image, at, poses, self._map)
        self._obstacle_map.update(position_m, attitude, image.obstacle_edges)
        self.seen_space.update(position_m, attitude, image.obstacle_edges)
        self._explorer.coverage.update(position_m, attitude, image.obstacle_edges)
        known = [colour for colour in COLOURS if self._map.best(colour) is not None]
        self.viewed_space.update(self._camera.pose(position_m, attitude))
        others = any(gate.colour not in COLOURS for gate in self._map.gates)
        self.viewed_space.needed = others or len(known) < len(COLOURS)
        self._glimpses.update(position_m, attitude, image, known, self._map.is_lookalike)

    def gate(self, colour: str) -> GateEstimate | None:
        """The gate of a colour in the axes of flight; None if it is not on the map."""
        known = self._map.best(colour)
        return known if known is None else self._in_flight.get(colour, known)

    def forget(self, colour: str) -> None:
        """Begin anew with the gate of a colour, on the map and as a landmark."""
        self._map.forget(colour)
        self.localization.forget(colour)
        self._gates = None

    @property
    def gates(self) -> tuple[GateEstimate, ...]:
        """All gates on the map, in the arena."""
        return tuple(
            self._known.get(gate.colour, gate) if gate is self._map.best(gate.colour) else gate
            for gate in self._map.gates
        )

    def gate_of(self, gate: GateEstimate) -> PathGate:
        """A gate as a path crosses it: in the arena that it has, also while it seems to be outside."""
        arena = self.arena_with(PathGate(gate.position_m, gate.yaw_rad, gate.shape))
        half_m = gate.shape.outer_height_m / 2
        x_m, y_m = arena.length_x_m / 2, arena.width_y_m / 2
        x, y, z = gate.position_m
        inside = (
            min(max(x, -x_m), x_m),
            min(max(y, -y_m), y_m),
            min(max(z, half_m), arena.height_m - half_m),
        )
        return PathGate(inside, gate.yaw_rad, gate.shape)

    @property
    def arena(self) -> Arena:
        """The arena, as it is told."""
        return self._surroundings.arena

    def arena_with(self, *gates: PathGate) -> Arena:
        """The arena in which gates are crossed.

        A gate has room before and behind its opening. If it seems to have none, the drone's place is wrong,
        and the sides are farther away by that.
        """
        arena, std_m = self._surroundings.arena, self.localization.plan_std_m
        if std_m == 0.0:
            return arena
        overs_m = []
        for gate in gates:
            (x, y, _), yaw = gate.centre_m, gate.yaw_rad
            room_m = LEAST_STRAIGHT_M + deeper_m(gate.shape)
            overs_m.append(abs(x) + room_m * abs(cos(yaw)) - arena.length_x_m / 2)
            overs_m.append(abs(y) + room_m * abs(sin(yaw)) - arena.width_y_m / 2)
        wider_m = min(
            max(overs_m) + self._style.side_margin_m + SIDES_SPARE_M, SIDES_STD * std_m, arena.margin_m / 2
        )
        if wider_m <= 0.0:
            return arena
        sides_m = {"length_x_m": arena.length_x_m + 2 * wider_m, "width_y_m": arena.width_y_m + 2 * wider_m}
        return arena.model_copy(update=sides_m)

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
