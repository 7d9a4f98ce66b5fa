"""What the primitives of a mission with `vision: frames` call: explore, cross, step back, fly to a point.

Every tick `observe` gives the drone's state and what was seen in new images; then one of the actions returns
the velocity to fly. An action keeps its goal and its path as long as it is called at every tick.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import dist, hypot

from framerunner.geometry.vectors import Vec3
from offboard.drone import DroneState, VelocityFluCommand
from offboard.limits import CONTEST, CommandLimits
from offboard.navigation.base_approach import SIGHTINGS_S, WayHome
from offboard.navigation.camera_model import CameraModel
from offboard.navigation.crossing_attempt import CrossingAttempt
from offboard.navigation.goals import Goal, PathGate, Point, style_of
from offboard.navigation.path_flight import STILL, PathFlight, position_now
from offboard.navigation.search.looking_places import LookingPlaces
from offboard.navigation.view import NavigationView, Surroundings
from offboard.navigation.world_model import WorldModel
from scenarios.models import COLOURS
from vision.types import Detections

GAP_S = 0.6  # an action that was not called for so long begins again
EXPLORE_S = 0.5  # between two choices of where to look next
HOME_HEIGHT_M = 0.5  # above the start, on the way home
AHEAD_STD_M = 0.3  # of a next gate; if it is known less well, it is not planned for yet
SPACED_S = 0.15  # in which one image is enough: one from nearly the same place adds little to the map
SPACED_M_S = 1.5  # up to this speed
NEAR_GATE_M = 1.5  # nearer to a gate to be crossed that is not certain yet, no image is left out
ANEW_REFUSALS = 3  # of a gate; then what was seen of it did not help, and it begins anew
VIEWPOINT_WORK = 85_000  # of choosing where to look next, in the unit of `PathFlight.work`
SEARCH_AFTER_M = 2.0  # from behind a gate to the drone, when it is chosen where to look from there


class Navigator:
    """The world model, the path, and the action that is flown.

    Positions are in the axes of flight: those of the arena, but continuous (`FlightAxes`).

    Attributes:
        expected_base: see `Localization.expected_base`.
    """

    def __init__(self, surroundings: Surroundings, limits: CommandLimits = CONTEST) -> None:
        self._style = style_of(limits)
        self._camera = CameraModel.of(surroundings.camera)
        self._world = WorldModel(surroundings, self._style)
        self.expected_base = self._world.localization.expected_base
        self._flight = PathFlight(surroundings.arena, self._style, limits)
        self._places = LookingPlaces(surroundings.arena, self._style)
        self._start_m: Vec3 | None = None
        self._state: DroneState | None = None
        self._action = ""
        self._acted_s = -GAP_S
        self._goal: Point | None = None
        self._way_home = WayHome(surroundings.base, surroundings.arena)
        self._chosen_s = 0.0
        self._crossing: CrossingAttempt | None = None
        self._steps_back = 0
        self._refusals: dict[str, int] = {}  # by colour
        self._alone = surroundings.alone
        self._added_m_s: Vec3 = (0.0, 0.0, 0.0)  # to the command at the last tick

    def observe(
        self, state: DroneState, images: Sequence[Detections], sent: VelocityFluCommand | None = None
    ) -> DroneState:
        """Add the state of this tick and what was seen in the images since the last one.

        Args:
            state: of the drone.
            images: what each of them showed.
            sent: the command that it has had since the last tick; None if it had none, or it is not known.

        Returns:
            The drone's state as it is estimated now, in the arena. It is flown in the axes of flight.
        """
        estimated = self._world.observe(state, images)
        state = self._world.localization.state_in_flight(estimated)
        if sent is not None:
            sent = _plus(sent, [-v for v in self._added_m_s])
        self._added_m_s = (0.0, 0.0, 0.0)
        self._flight.learn(state, sent)
        self._state = state
        if self._start_m is None:
            self._start_m = position_now(state)
        return estimated

    def is_known(self, colour: str) -> bool:
        """The gate is on the map."""
        return self._world.gate(colour) is not None

    def is_certain(self, colour: str) -> bool:
        """The gate is known well enough to fly through."""
        estimate = self._world.gate(colour)
        return estimate is not None and estimate.certain

    def has_crossed(self, colour: str) -> bool:
        """`cross` has flown through this gate and is clear of it."""
        crossing = self._crossing
        return crossing is not None and crossing.colour == colour and crossing.cleared

    @property
    def image_period_s(self) -> float:
        """In which one image is enough; 0: all are needed, in fast flight or near what is not certain."""
        state, crossing = self._state, self._crossing
        if (
            self._alone
            or state is None
            or hypot(*state.velocity_arena_m_s) > SPACED_M_S
            or self._flight.looks
        ):
            return 0.0
        if crossing is not None and self._action == f"cross {crossing.colour}":
            estimate = self._world.gate(crossing.colour)
            if estimate is None:
                return 0.0
            if not estimate.certain and dist(estimate.position_m, position_now(state)) < NEAR_GATE_M:
                return 0.0
        return SPACED_S

    @property
    def refused(self) -> bool:
        """`cross` cannot go on."""
        return self._crossing is not None and bool(self._crossing.refusal)

    @property
    def arrived(self) -> bool:
        """`fly_to` or `step_back` has reached its goal, and the drone is (nearly) at rest."""
        goal, state = self._goal, self._state
        if goal is None or state is None or self._way_home.looks:
            return False
        near = dist(position_now(state), goal.position_m) < self._style.arrived_m
        return near and hypot(*state.velocity_arena_m_s) < self._style.arrived_m_s

    def view(self) -> NavigationView:
        """The map and the path, for displays."""
        path = self._flight.path
        crossing = self._crossing
        trouble = "" if path is not None else self._flight.refusal
        if crossing is not None and crossing.refusal:
            trouble = f"{crossing.colour}: {crossing.refusal}"
        points = () if path is None else path.points_m
        return NavigationView(self._world.gates, points, self._action, trouble)

    def explore(self) -> VelocityFluCommand:
        """Fly to the view that shows most of what was not seen yet, or corrects the place."""
        state, now_s = self._begin("explore")
        way, no_path = self._way_home, _has_no_path(self._flight)
        looked = way.looks
        look = way.correction(state, _base_known(self._world, state), no_path=no_path)
        if look is not None:
            return self._fly_towards(look)
        if looked or self._goal is None or now_s - self._chosen_s >= EXPLORE_S:
            if self._goal is not None and no_path and not looked:
                self._world.refuse_viewpoint()
            self._flight.spent += VIEWPOINT_WORK
            viewpoint = self._world.next_viewpoint(position_now(state), state.yaw)
            self._goal, self._chosen_s = Point(viewpoint.position_m, viewpoint.yaw_rad), now_s
        return self._compensated(self._fly(self._goal))

    def fly_to(self, goal_m: Vec3) -> VelocityFluCommand:
        """Fly to a point on a smooth path; to one on the base, when that was looked at if need be."""
        state, _ = self._begin("fly to goal")
        way, no_path = self._way_home, _has_no_path(self._flight)
        searched = way.searches
        goal = way.goal(goal_m, state, _base_known(self._world, state), no_path=no_path)
        if way.searches and not searched:
            self._world.localization.doubt()
        return self._fly_towards(goal)

    def step_back(self, colour: str) -> VelocityFluCommand:
        """Fly back from a gate, to one of its sides, facing it; one that was refused often begins anew."""
        state, _ = self._begin(f"step back from {colour}")
        self._world.localization.stay_by(colour)
        if self._goal is None:
            gate, here_m = self._world.gate(colour), position_now(state)
            if gate is None:
                self._goal = self._places.back(here_m, state.yaw)
            else:
                side = 1 if self._steps_back % 2 else -1
                self._goal = self._places.aside(gate, here_m, side, self._world.obstacles())
            self._steps_back += 1
            self._refusals[colour] = self._refusals.get(colour, 0) + 1
            if self._refusals[colour] % ANEW_REFUSALS == 0:
                self._world.forget(colour)
        return self._compensated(self._fly(self._goal))

    def cross(self, colour: str) -> VelocityFluCommand:
        """Fly through a gate as the map has it now, and on towards what comes next."""
        return self._compensated(self._cross(colour))

    def _cross(self, colour: str) -> VelocityFluCommand:
        state, now_s = self._begin(f"cross {colour}")
        self._world.localization.stay_by(colour)
        crossing = self._crossing
        if crossing is None or crossing.colour != colour or crossing.refusal:
            crossing = self._crossing = CrossingAttempt(colour, now_s, now_s, now_s)
        crossing.move(position_now(state), now_s)
        if crossing.cleared:
            self._refusals.pop(colour, None)
        estimate = self._world.gate(colour)
        goes_on = crossing.is_committed or (estimate is not None and crossing.is_settled(estimate))
        if goes_on and crossing.is_on(self._flight.path):
            return self._flight.follow(state)
        if crossing.passed and crossing.behind is not None:  # and stopped within the gate
            return self._fly(crossing.behind)
        if estimate is None:
            crossing.lose(now_s)
            return STILL
        crossing.known_s = now_s
        looked = crossing.looks
        gate = self._world.gate_of(estimate)
        distance_m = dist(gate.centre_m, position_now(state))  # not to where it seems to be outside the arena
        farther_m = max(self._camera.whole_from_m(estimate.shape) - self._style.look_again_m, 0.0)
        near_m = self._style.look_again_m + self._style.look_braking_m + farther_m
        if crossing.must_look(estimate, distance_m, near_m, now_s) != looked:
            self._flight.change()
        if crossing.looks:
            here_m, obstacles = position_now(state), self._world.obstacles()
            place = self._places.before(estimate, here_m, obstacles, farther_m)
            command = self._fly(place)
            if crossing.must_stop and crossing.is_on(self._flight.path):  # no path to the place yet
                self._flight.leave()
                return self._flight.follow(state)
            return command
        after = self._goals_after(colour)
        gates_after = [goal for goal in after if isinstance(goal, PathGate)]
        self._flight.arena = self._world.arena_with(gate, *gates_after)
        command = self._fly(gate, *after)
        path = self._flight.path
        finds_way = path is not None or self._flight.looks
        no_path = "" if finds_way else self._flight.refusal or "none was planned"
        crossing.fly(no_path=no_path, now_s=now_s)
        if path is not None and path.crossings:
            crossing.aim(path.crossings[0])
        return command

    def _compensated(self, command: VelocityFluCommand) -> VelocityFluCommand:
        """What to command to a vehicle that is wrong about its velocity, so that it flies a command."""
        added = self._world.localization.velocity_error_flu_m_s
        if not any(added):
            return command
        self._added_m_s = added
        return _plus(command, added)

    def _begin(self, action: str) -> tuple[DroneState, float]:
        """Note which action is flown at this tick; a new one, or one after a gap, has no goal yet."""
        state = self._state
        if state is None:
            raise RuntimeError("observe() comes before any action")
        now_s = state.time_us * 1e-6
        gap = now_s - self._acted_s > GAP_S
        if gap:
            self._flight.stop()
        if gap or action != self._action:
            self._action, self._goal = action, None
            self._way_home.begin()
            self._flight.arena = self._world.arena
            self._flight.change()
        self._acted_s = now_s
        return state, now_s

    def _fly_towards(self, goal: Point) -> VelocityFluCommand:
        """Fly to a point, on a new path if it is another one than before."""
        if self._goal != goal:
            self._goal = goal
            self._flight.change()
        return self._compensated(self._fly(goal))

    def _fly(self, *goals: Goal) -> VelocityFluCommand:
        assert self._state is not None, "observe() comes before any action"
        world = self._world
        return self._flight.fly(goals, world.obstacles(), self._state, world.seen_space, world.viewed_space)

    def _goals_after(self, colour: str) -> list[Goal]:
        """The next gate, if it is on the map; after the last one, the start."""
        following = COLOURS[COLOURS.index(colour) + 1 :] if colour in COLOURS else ()
        if not following:
            x, y, z = self._start_m or (0.0, 0.0, 0.0)
            return [Point((x, y, z + HOME_HEIGHT_M))]
        estimate = self._world.gate(following[0])
        if estimate is None or estimate.ambiguous or max(estimate.position_std_m) > AHEAD_STD_M:
            return self._search_after()
        return [self._world.gate_of(estimate)]

    def _search_after(self) -> list[Goal]:
        """Where to look from behind the gate that is crossed, once the drone is near it."""
        assert self._state is not None, "observe() comes before any action"
        crossing, here_m = self._crossing, position_now(self._state)
        behind = None if crossing is None else crossing.behind
        if crossing is None or behind is None or dist(behind.position_m, here_m) > SEARCH_AFTER_M:
            return []
        if crossing.after is None:
            self._flight.spent += VIEWPOINT_WORK
            viewpoint = self._world.next_viewpoint(behind.position_m, behind.yaw_rad or 0.0, from_here=False)
            crossing.after = Point(viewpoint.position_m, viewpoint.yaw_rad)
        return [crossing.after]


def _plus(command: VelocityFluCommand, velocity_flu_m_s: Sequence[float]) -> VelocityFluCommand:
    forward, left, up = velocity_flu_m_s
    return replace(
        command,
        forward_m_s=command.forward_m_s + forward,
        left_m_s=command.left_m_s + left,
        up_m_s=command.up_m_s + up,
    )


def _has_no_path(flight: PathFlight) -> bool:
    """None was found to where the drone was to fly."""
    return flight.path is None and flight.search is None and bool(flight.refusal)


def _base_known(world: WorldModel, state: DroneState) -> tuple[int, float] | None:
    """See `Localization.base_known`; in the last `SIGHTINGS_S`."""
    return world.localization.base_known(state.time_us - round(SIGHTINGS_S * 1e6))
