"""The simulated world: one drone, ground, base, gates, obstacles and wind, advanced in fixed steps."""

from __future__ import annotations

from math import dist, hypot, isfinite, sqrt

from framerunner.geometry.axes import flip_quaternion, flip_vector, flip_yaw
from framerunner.geometry.rotations import rotation, rotation_rows, to_body, to_world, yaw_of
from framerunner.geometry.solids import Solid
from framerunner.geometry.vectors import ZERO3, Vec3, minus, plus
from framerunner.vehicle.airframe import GRAVITY_M_S2, Airframe
from framerunner.vehicle.measurements import MotorSpeeds, Sensors
from scenarios.models import Scenario, TrueState, is_over_base, start_position
from sitl.air.wind import SimulatedWind
from sitl.dynamics import Dynamics, DynamicsError
from sitl.solids import gate_solids, touch

PHYSICS_RATE_HZ = 500
STEPS_PER_CONTROL = 2
PHYSICS_PERIOD_US = 1_000_000 // PHYSICS_RATE_HZ
CONTROL_PERIOD_US = STEPS_PER_CONTROL * PHYSICS_PERIOD_US
_SETTLING_STEPS = PHYSICS_RATE_HZ  # one second, to stand at rest before time starts
_MIN_MARGIN_M = 0.05  # how much nearer the drone may come within one control period (12 m/s)
_SPEED_MARGIN = 1.25  # of the airframe's maximum speed
_ACCELERATION_MARGIN = 2.0  # over full thrust and gravity together; a touch may be harder, but adds no speed
MAX_TURN_RAD = 0.2  # in a step of the physics; of a faster rotation the steps are no longer a good measure
MAX_RATE_RAD_S = MAX_TURN_RAD * PHYSICS_RATE_HZ
_BRAKED = 0.5  # of a rotation that is too fast, in a step
_MAX_FAR_TICKS = 250  # the longest time for which distant solids are not checked


def _diverged(airframe: str, time_us: int) -> DynamicsError:
    return DynamicsError(
        f"airframe {airframe}: its motion is not a number after {time_us / 1e6:g} s; make it heavier "
        "(mass_kg, inertia_kg_m2), its contact softer (stiffness_n_m, damping_n_s_m), or its drag smaller"
    )


class World:
    """Everything that moves or can be touched in a scenario.

    Args:
        scenario: to be simulated.
        airframe: of the drone.
        seed: of everything random.

    Attributes:
        scenario: the simulated one.
        airframe: of the drone.
        dynamics: of the drone.
        time_us: simulated time since the drone was switched on.
        position_arena_m: of the drone's centre.
        radius_m: of the sphere around the drone.
        crash: why the motors stand and the drone cannot fly, as the predicate to "the drone"; empty: it can.
    """

    def __init__(self, scenario: Scenario, airframe: Airframe, seed: int = 0) -> None:
        self.scenario = scenario
        self.airframe = airframe
        self.time_us = 0
        self.crash = ""
        self._standing = (0.0,) * len(airframe.rotors)
        self._half_m: Vec3 = tuple(extent / 2 for extent in airframe.envelope_m)  # type: ignore[assignment]
        self._neighbours: tuple[Solid, ...] = ()
        self.radius_m = hypot(*self._half_m)
        wind = scenario.wind
        self._wind = SimulatedWind(wind, seed, CONTROL_PERIOD_US / 1e6) if wind.blows else None
        fastest_m_s = _SPEED_MARGIN * airframe.limits.speed_horizontal_m_s + wind.highest_m_s
        self._margin_m = max(_MIN_MARGIN_M, fastest_m_s * CONTROL_PERIOD_US / 1e6)
        self._reach_m = self.radius_m + self._margin_m
        full_thrust_m_s2 = airframe.full_thrust_n / airframe.mass_kg
        wind_m_s2 = max(airframe.drag.force_n_s2_m2) * wind.highest_m_s**2 / airframe.mass_kg
        self._acceleration_m_s2 = _ACCELERATION_MARGIN * (full_thrust_m_s2 + GRAVITY_M_S2 + wind_m_s2)
        self._base_top_m = scenario.base.top_m
        self._base_level_m = scenario.base.top_m - self._half_m[2]  # a centre on the base is higher than this
        self._groups = [_Group(gate.position_arena_m, gate_solids(gate)) for gate in scenario.all_gates]
        self._prisms = scenario.prisms
        base = scenario.base.solid
        self._base = _Group(base.centre_arena_m, (base,))
        self._far_ticks = 0  # during which nothing can be touched
        self._is_near = True  # in this control period something may be touched: `_near`
        self._near: tuple[Solid, ...] = ()
        self._ground_m = 0.0
        self._touching: dict[Solid, Vec3] = {}  # with the normal at the beginning of the touch
        self._pushed: tuple[Vec3, Vec3] = (ZERO3, ZERO3)  # force and moment of the touches, body axes
        x_m, y_m, surface_m = start_position(scenario)
        self.dynamics = Dynamics(
            airframe,
            flip_vector((x_m, y_m, surface_m + self._half_m[2])),
            flip_yaw(scenario.start.yaw_rad),
            latitude_deg=scenario.origin.latitude_deg,
            longitude_deg=scenario.origin.longitude_deg,
            altitude_m=scenario.origin.altitude_m,
            rate_hz=PHYSICS_RATE_HZ,
        )
        self._ground_m = surface_m
        self.dynamics.set_ground_height(surface_m)
        for _ in range(_SETTLING_STEPS):
            self.dynamics.run()
        self._position_ned_m = self.dynamics.position_ned_m()
        self.position_arena_m = flip_vector(self._position_ned_m)

    def step(self, motor_speeds_rad_s: MotorSpeeds) -> None:
        """Advance by one control period with these motor commands (rad/s, the airframe's order)."""
        self.begin_step(motor_speeds_rad_s)
        for _ in range(STEPS_PER_CONTROL):
            self.run_physics()
        self.end_step()

    def begin_step(self, motor_speeds_rad_s: MotorSpeeds) -> None:
        """Begin a control period; `STEPS_PER_CONTROL` times `run_physics` and `end_step` must follow.

        Between two of them `dynamics` may be read, and the motors commanded.
        """
        dynamics = self.dynamics
        self.command_motors(motor_speeds_rad_s)
        if self._wind is not None:
            dynamics.set_air_velocity(self._wind.step(dynamics.velocity_ned_m_s))
        self._is_near = self._far_ticks <= 0
        if self._is_near:
            self._near = self._find_near()
        else:
            self._far_ticks -= 1

    def command_motors(self, speeds_rad_s: MotorSpeeds) -> None:
        """Set the commanded rotor speeds, rad/s; after a crash they stand."""
        self.dynamics.command_motors(self._standing if self.crash else speeds_rad_s)

    def run_physics(self) -> None:
        """Advance by one step of the physics."""
        if self._is_near and (self._near or self._touching):
            self._push_from(self._near)
        if self.crash:
            self._brake()
        self.dynamics.run()

    def end_step(self) -> None:
        """End a control period; a drone that turns faster than can be simulated has crashed.

        Raises:
            DynamicsError: the motion is not finite: forces are too large for the mass and the physics' step.
        """
        dynamics = self.dynamics
        p, q, r = dynamics.angular_rate_frd_rad_s()
        if abs(p) > MAX_RATE_RAD_S or abs(q) > MAX_RATE_RAD_S or abs(r) > MAX_RATE_RAD_S:
            self.crash = f"turned faster than {MAX_RATE_RAD_S:g} rad/s"
        if self._is_near:
            dynamics.set_ground_height(self._ground_m)
        self.time_us += CONTROL_PERIOD_US
        self._position_ned_m = position = dynamics.position_ned_m()
        if not isfinite(position[0] + position[1] + position[2]):
            raise _diverged(self.scenario.airframe, self.time_us)
        self.position_arena_m = flip_vector(position)

    def sensors(self) -> Sensors:
        """Sample ideal sensors now."""
        velocity, attitude, rate, force = self.dynamics.motion()
        return Sensors(self.time_us, self._position_ned_m, velocity, attitude, rate, force)

    def truth(self, sensors: Sensors, *, motors_on: bool) -> TrueState:
        """The true state for the referee.

        Args:
            sensors: the ideal sample of this instant, so that JSBSim is read only once.
            motors_on: whether the autopilot is armed.
        """
        position = self.position_arena_m
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
            sensors.angular_rate_frd_rad_s,
            crash=self.crash,
        )

    def repair(self) -> None:
        """Let the motors of a drone that has crashed turn again."""
        if self.crash:
            self.crash = ""
            self.dynamics.push(*self._pushed)

    def box(self, name: str) -> Solid:
        """The drone's box, upright, with its heading now: a solid for other drones."""
        yaw_rad = flip_yaw(yaw_of(self.dynamics.attitude()))
        return Solid(name, self.position_arena_m, yaw_rad, self._half_m)

    def set_neighbours(self, neighbours: tuple[Solid, ...]) -> None:
        """Set the boxes of other drones that are near; they hold until the next call."""
        self._neighbours = neighbours
        if neighbours:
            self._far_ticks = 0

    @property
    def touched(self) -> set[str]:
        """Names of the solids that the drone touches now."""
        return {solid.name for solid in self._touching}

    def _is_above_base(self) -> bool:
        """Whether the base's top supports the drone: its centre is over the top and not below it.

        JSBSim has one ground height for the whole drone. A drone whose centre of mass is beyond the edge
        would tip over, so the centre decides; the base's sides are a solid of their own.
        """
        x, y, z = self.position_arena_m
        return z > self._base_level_m and is_over_base(self.scenario.base, x, y)

    def _touches_ground(self) -> bool:
        ground_m = self._base_top_m if self._is_above_base() else 0.0
        return self.position_arena_m[2] - ground_m < self._reach_m and self.dynamics.touches_ground()

    def _find_near(self) -> tuple[Solid, ...]:
        """The solids that could be touched within the next control period.

        Sets the ground's height, and the time for which more distant solids need not be checked.
        """
        position, reach = self.position_arena_m, self._reach_m
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
        for prism in self._prisms:  # too long for a sphere around them
            gap_m = prism.distance_m(position)
            nearest_m = min(nearest_m, gap_m)
            if gap_m < reach:
                near += (prism,)
        self._far_ticks = self._ticks_to(nearest_m - reach)
        if self._neighbours:
            self._far_ticks = 0
            near += self._neighbours
        return (*near, *self._base.solids) if base_gap_m < reach and not above_base else near

    def _ticks_to(self, distance_m: float) -> int:
        """How many control ticks it takes at least to come so far, from the present speed."""
        if distance_m <= 0.0:
            return 0
        speed_m_s, most = hypot(*self.dynamics.velocity_ned_m_s()), self._acceleration_m_s2
        if not isfinite(speed_m_s):
            raise _diverged(self.scenario.airframe, self.time_us)
        time_s = (sqrt(speed_m_s * speed_m_s + 2.0 * most * distance_m) - speed_m_s) / most
        return min(int(time_s * 1e6 / CONTROL_PERIOD_US), _MAX_FAR_TICKS)

    def _push_from(self, near: tuple[Solid, ...]) -> None:
        """Apply a spring, a damper and friction at each touch (penalty method)."""
        dynamics = self.dynamics
        position = flip_vector(dynamics.position_ned_m())
        near = tuple([solid for solid in near if solid.is_within(self.radius_m, position)])
        if not near:
            if self._touching:
                self._touching = {}
                self._push(ZERO3, ZERO3)
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
            arm = minus(found.point_arena_m, position)
            push = self._touch_force(found.depth_m, found.normal_arena, plus(motion, _cross(spin, arm)))
            twist = _cross(arm, push)
            for i in range(3):
                force[i] += push[i]
                moment[i] += twist[i]
        self._touching = touching
        self._push(
            flip_vector(to_body(turn, force[0], force[1], force[2])),
            flip_vector(to_body(turn, moment[0], moment[1], moment[2])),
        )

    def _push(self, force_frd_n: Vec3, moment_frd_nm: Vec3) -> None:
        self._pushed = force_frd_n, moment_frd_nm
        self.dynamics.push(force_frd_n, moment_frd_nm)

    def _brake(self) -> None:
        """Add a moment to those of the touches that slows a rotation about an axis which is too fast."""
        force, moment = self._pushed
        rate, inertia = self.dynamics.angular_rate_frd_rad_s(), self.airframe.inertia_kg_m2
        braking = [
            -_BRAKED * rate[i] * inertia[i] * PHYSICS_RATE_HZ if abs(rate[i]) > MAX_RATE_RAD_S / 2 else 0.0
            for i in range(3)
        ]
        self.dynamics.push(force, (moment[0] + braking[0], moment[1] + braking[1], moment[2] + braking[2]))

    def _touch_force(self, depth_m: float, normal: Vec3, velocity_m_s: Vec3) -> Vec3:
        contact = self.airframe.contact
        closing = -(normal[0] * velocity_m_s[0] + normal[1] * velocity_m_s[1] + normal[2] * velocity_m_s[2])
        pressing = max(0.0, contact.stiffness_n_m * depth_m + contact.damping_n_s_m * closing)
        sliding = plus(velocity_m_s, _scaled(normal, closing))
        speed = hypot(*sliding)
        # Coulomb friction, replaced by a damper near standstill.
        drag = min(contact.friction * pressing / speed, contact.damping_n_s_m) if speed > 1e-9 else 0.0
        return plus(_scaled(normal, pressing), _scaled(sliding, -drag))


class _Group:
    """Solids that are close to each other, and the sphere around them (`centre_arena_m`)."""

    def __init__(self, centre_arena_m: Vec3, solids: tuple[Solid, ...]) -> None:
        self.solids = solids
        self._centre_arena_m = centre_arena_m
        self._radius_m = max(
            dist(centre_arena_m, solid.centre_arena_m) + hypot(*solid.half_extents_m) for solid in solids
        )

    def gap_m(self, point_m: Vec3) -> float:
        """Distance of a point from the sphere, below zero inside."""
        return dist(point_m, self._centre_arena_m) - self._radius_m


def _scaled(a: Vec3, factor: float) -> Vec3:
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def _cross(a: Vec3, b: Vec3) -> Vec3:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
