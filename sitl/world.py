"""The simulated world: one drone, the ground, the base and the frames, stepped in fixed time.

No clock, socket or thread: `step` advances simulated time by one control period, always the same way.
"""

from __future__ import annotations

from math import dist, hypot

from firmware_py.airframe import Airframe
from firmware_py.types import MotorSpeeds, Sensors
from geometry.axes import flip_quaternion, flip_vector, flip_yaw
from geometry.rotations import rotation, rotation_rows, to_body, to_world, yaw_of
from geometry.vectors import Vec3
from scenarios.models import Scenario, TrueState, is_over_base, start_position
from sitl.dynamics import Dynamics
from sitl.solids import Solid, base_solid, frame_solids, touch

PHYSICS_RATE_HZ = 500
STEPS_PER_CONTROL = 2
CONTROL_PERIOD_US = 1_000_000 * STEPS_PER_CONTROL // PHYSICS_RATE_HZ
_SETTLING_STEPS = PHYSICS_RATE_HZ  # one second, to stand at rest before time starts
_LEAST_MARGIN_M = 0.05  # how far the drone may come nearer within one control period (12 m/s)
_SPEED_MARGIN = 1.25  # of the airframe's greatest speed, for one that is faster
_NOTHING: Vec3 = (0.0, 0.0, 0.0)
_FAR_TICKS = 250  # the longest time for which what is far is not looked at


class World:
    """Everything that moves or can be touched in a scenario.

    Attributes:
        scenario: what is simulated.
        airframe: the drone's numbers.
        time_us: simulated time since the drone was switched on.
    """

    def __init__(self, scenario: Scenario, airframe: Airframe) -> None:
        self.scenario = scenario
        self.airframe = airframe
        self.time_us = 0
        self._half_m: Vec3 = tuple(extent / 2 for extent in airframe.envelope_m)  # type: ignore[assignment]
        self._neighbours: tuple[Solid, ...] = ()
        self._radius_m = hypot(*self._half_m)
        fastest_m_s = _SPEED_MARGIN * airframe.limits.speed_horizontal_m_s
        self._margin_m = max(_LEAST_MARGIN_M, fastest_m_s * CONTROL_PERIOD_US / 1e6)
        self._reach_m = self._radius_m + self._margin_m
        self._base_top_m = scenario.base.top_m
        self._base_level_m = scenario.base.top_m - self._half_m[2]  # a centre on the base is higher than this
        self._groups = [_Group(frame.position_arena_m, frame_solids(frame)) for frame in scenario.frames]
        base = base_solid(scenario)
        self._base = _Group(base.centre_arena_m, (base,))
        self._far_ticks = 0  # for so long nothing can be touched
        self._ground_m = 0.0
        self._touching: dict[Solid, Vec3] = {}  # with the normal of the side it was entered through
        x_m, y_m, surface_m = start_position(scenario)
        self._dynamics = Dynamics(
            airframe,
            flip_vector((x_m, y_m, surface_m + self._half_m[2])),
            flip_yaw(scenario.start.yaw_rad),
            latitude_deg=scenario.origin.latitude_deg,
            longitude_deg=scenario.origin.longitude_deg,
            altitude_m=scenario.origin.altitude_m,
            rate_hz=PHYSICS_RATE_HZ,
        )
        self._ground_m = surface_m
        self._dynamics.set_ground_height(surface_m)
        for _ in range(_SETTLING_STEPS):
            self._dynamics.run()
        self._position_ned_m = self._dynamics.position_ned_m()
        self._position_arena_m = flip_vector(self._position_ned_m)

    def step(self, motor_speeds_rad_s: MotorSpeeds) -> None:
        """Advance by one control period with these motor commands (rad/s, the airframe's order)."""
        dynamics = self._dynamics
        dynamics.command_motors(motor_speeds_rad_s)
        run = dynamics.run
        if self._far_ticks > 0:
            self._far_ticks -= 1
            for _ in range(STEPS_PER_CONTROL):
                run()
        else:
            near = self._look_around()
            for _ in range(STEPS_PER_CONTROL):
                if near or self._touching:
                    self._push_from(near)
                run()
            dynamics.set_ground_height(self._ground_m)
        self.time_us += CONTROL_PERIOD_US
        self._position_ned_m = position = dynamics.position_ned_m()
        self._position_arena_m = flip_vector(position)

    def fail_motor(self, index: int, *, stuck: bool = False) -> None:
        """Cut a motor off from its commands: it stops, or goes on at the speed last commanded (`stuck`)."""
        self._dynamics.fail_motor(index, stuck=stuck)

    def repair_motor(self, index: int) -> None:
        """Let a motor follow its commands again."""
        self._dynamics.repair_motor(index)

    def sensors(self) -> Sensors:
        """Sample ideal sensors now."""
        velocity, attitude, rate, force = self._dynamics.motion()
        return Sensors(self.time_us, self._position_ned_m, velocity, attitude, rate, force)

    def truth(self, sensors: Sensors, *, motors_on: bool) -> TrueState:
        """Return the true state for the referee.

        Args:
            sensors: the ideal sample of this instant (so that JSBSim is read only once).
            motors_on: whether the autopilot is armed.
        """
        position = self._position_arena_m
        contacts: tuple[str, ...] = ()
        if self._touching:
            contacts = tuple(dict.fromkeys(solid.name for solid in self._touching))
        if position[2] < self._base_top_m + self._reach_m and self._touches_ground():
            contacts = (*contacts, "base" if self._is_above_base() else "floor")
        return TrueState(
            self.time_us,
            position,
            flip_vector(sensors.velocity_ned_m_s),
            flip_quaternion(sensors.attitude),
            motors_on,
            contacts,
        )

    def box(self, name: str) -> Solid:
        """The drone's own box, upright and as it is headed now, for others to run into."""
        yaw_rad = flip_yaw(yaw_of(self._dynamics.attitude()))
        return Solid(name, self._position_arena_m, yaw_rad, self._half_m)

    def meet(self, neighbours: tuple[Solid, ...]) -> None:
        """Tell what else is near that moves: the boxes of other drones, until told otherwise."""
        self._neighbours = neighbours
        if neighbours:
            self._far_ticks = 0

    @property
    def position_arena_m(self) -> Vec3:
        """Where the drone's centre is."""
        return self._position_arena_m

    @property
    def radius_m(self) -> float:
        """Of the ball around the drone."""
        return self._radius_m

    @property
    def touched(self) -> set[str]:
        """Names of the solids that it touches now."""
        return {solid.name for solid in self._touching}

    def motor_speeds_rad_s(self) -> MotorSpeeds:
        """True speeds of the rotors."""
        return self._dynamics.motor_speeds_rad_s()

    def _is_above_base(self) -> bool:
        """Whether the base's top carries the drone: its centre is over the top and not below it.

        JSBSim knows one ground height for the whole drone. A drone whose centre of mass is beyond the
        edge would tip off, so the centre decides; the base's sides are a solid of their own.
        """
        x, y, z = self._position_arena_m
        return z > self._base_level_m and is_over_base(self.scenario.base, x, y)

    def _touches_ground(self) -> bool:
        ground_m = self._base_top_m if self._is_above_base() else 0.0
        return self._position_arena_m[2] - ground_m < self._reach_m and self._dynamics.touches_ground()

    def _look_around(self) -> tuple[Solid, ...]:
        """Return the solids that could be touched within the next control period; note the ground's height.

        When all are farther away, note for how long they need not be looked at again.
        """
        position, reach = self._position_arena_m, self._reach_m
        above_base = self._is_above_base()
        self._ground_m = self._base_top_m if above_base else 0.0
        base_gap_m = self._base.gap_m(position)
        nearest_m = base_gap_m
        near: tuple[Solid, ...] = ()
        for group in self._groups:
            gap_m = group.gap_m(position)
            nearest_m = min(nearest_m, gap_m)
            if gap_m < reach:
                near += tuple([solid for solid in group.solids if solid.is_within(reach, position)])
        self._far_ticks = min(int((nearest_m - reach) / self._margin_m), _FAR_TICKS)
        if self._neighbours:
            self._far_ticks = 0
            near += self._neighbours
        return (*near, *self._base.solids) if base_gap_m < reach and not above_base else near

    def _push_from(self, near: tuple[Solid, ...]) -> None:
        """Set force and moment of a spring, a damper and friction at each touch (penalty method)."""
        dynamics = self._dynamics
        position = flip_vector(dynamics.position_ned_m())
        near = tuple([solid for solid in near if solid.is_within(self._radius_m, position)])
        if not near:
            if self._touching:
                self._touching = {}
                dynamics.push(_NOTHING, _NOTHING)
            return
        turn = rotation(flip_quaternion(dynamics.attitude()))
        rows = rotation_rows(turn)
        spin = to_world(turn, *flip_vector(dynamics.angular_rate_frd_rad_s()))
        motion = flip_vector(dynamics.velocity_ned_m_s())
        force, moment = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        touching: dict[Solid, Vec3] = {}
        for solid in near:
            found = touch(solid, position, rows, self._half_m, self._touching.get(solid))
            if found is None:
                continue
            touching[solid] = found.normal_arena
            arm = _minus(found.point_arena_m, position)
            push = self._touch_force(found.depth_m, found.normal_arena, _plus(motion, _cross(spin, arm)))
            twist = _cross(arm, push)
            for i in range(3):
                force[i] += push[i]
                moment[i] += twist[i]
        self._touching = touching
        dynamics.push(
            flip_vector(to_body(turn, force[0], force[1], force[2])),
            flip_vector(to_body(turn, moment[0], moment[1], moment[2])),
        )

    def _touch_force(self, depth_m: float, normal: Vec3, velocity_m_s: Vec3) -> Vec3:
        contact = self.airframe.contact
        closing = -_dot(normal, velocity_m_s)
        pressing = max(0.0, contact.stiffness_n_m * depth_m + contact.damping_n_s_m * closing)
        sliding = _plus(velocity_m_s, _scaled(normal, closing))
        speed = hypot(*sliding)
        # Coulomb friction, made steady near standstill by a damper.
        drag = min(contact.friction * pressing / speed, contact.damping_n_s_m) if speed > 1e-9 else 0.0
        return _plus(_scaled(normal, pressing), _scaled(sliding, -drag))


class _Group:
    """Solids that stand together, and the ball around them.

    Args:
        centre_arena_m: of the ball.
        solids: what it holds.
    """

    __slots__ = ("_centre_arena_m", "_radius_m", "solids")

    def __init__(self, centre_arena_m: Vec3, solids: tuple[Solid, ...]) -> None:
        self.solids = solids
        self._centre_arena_m = centre_arena_m
        self._radius_m = max(
            dist(centre_arena_m, solid.centre_arena_m) + hypot(*solid.half_extents_m) for solid in solids
        )

    def gap_m(self, point_m: Vec3) -> float:
        """From a point to the ball, below zero inside."""
        return dist(point_m, self._centre_arena_m) - self._radius_m


def _dot(a: Vec3, b: Vec3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _plus(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _minus(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _scaled(a: Vec3, factor: float) -> Vec3:
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def _cross(a: Vec3, b: Vec3) -> Vec3:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
