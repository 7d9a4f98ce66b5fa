"""The simulated world: one drone, the ground, the base and the frames, stepped in fixed time.

No clock, socket or thread: `step` advances simulated time by one control period, always the same way.
"""

from __future__ import annotations

from math import hypot

from firmware_py.airframe import Airframe
from firmware_py.types import MotorSpeeds, Sensors, Vec3
from scenarios.axes import Quaternion, flip_quaternion, flip_vector, flip_yaw
from scenarios.ground import is_over_base, start_position
from scenarios.models import Scenario
from scenarios.truth import TrueState
from sitl.dynamics import Dynamics
from sitl.solids import Matrix, Solid, base_solid, frame_solids, touch

PHYSICS_RATE_HZ = 500
STEPS_PER_CONTROL = 2
CONTROL_PERIOD_US = 1_000_000 * STEPS_PER_CONTROL // PHYSICS_RATE_HZ
_SETTLING_STEPS = PHYSICS_RATE_HZ  # one second, to stand at rest before time starts
_MARGIN_M = 0.05  # how far the drone may come nearer within one control period (12 m/s)


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
        self._reach_m = hypot(*self._half_m) + _MARGIN_M
        self._base = base_solid(scenario)
        self._base_top_m = scenario.base.top_m
        self._base_level_m = scenario.base.top_m - self._half_m[2]  # a centre on the base is higher than this
        self._base_reach_m = self._base.half_extents_m[0] + self._reach_m
        self._groups = [
            (
                *frame.position_arena_m,
                hypot(frame.outer_width_m, frame.outer_height_m, frame.bar_m) / 2 + self._reach_m,
                frame_solids(frame),
            )
            for frame in scenario.frames
        ]
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
        self._dynamics.set_ground_height(surface_m)
        for _ in range(_SETTLING_STEPS):
            self._dynamics.run()
        self._position_ned_m = self._dynamics.position_ned_m()

    def step(self, motor_speeds_rad_s: MotorSpeeds) -> None:
        """Advance by one control period with these motor commands (rad/s, the airframe's order)."""
        dynamics = self._dynamics
        dynamics.command_motors(motor_speeds_rad_s)
        position = flip_vector(self._position_ned_m)
        near = self._near(position)
        for _ in range(STEPS_PER_CONTROL):
            if near or self._touching:
                self._push_from(near)
            dynamics.run()
        self.time_us += CONTROL_PERIOD_US
        dynamics.set_ground_height(self._ground_below(position))
        self._position_ned_m = dynamics.position_ned_m()

    def sensors(self) -> Sensors:
        """Sample ideal sensors now."""
        dynamics = self._dynamics
        return Sensors(
            self.time_us,
            self._position_ned_m,
            dynamics.velocity_ned_m_s(),
            dynamics.attitude(),
            dynamics.angular_rate_frd_rad_s(),
            dynamics.specific_force_frd_m_s2(),
        )

    def truth(self, sensors: Sensors, *, motors_on: bool) -> TrueState:
        """Return the true state for the referee.

        Args:
            sensors: the ideal sample of this instant (so that JSBSim is read only once).
            motors_on: whether the autopilot is armed.
        """
        position = flip_vector(sensors.position_ned_m)
        contacts: tuple[str, ...] = ()
        if self._touching:
            contacts = tuple(dict.fromkeys(solid.name for solid in self._touching))
        low = position[2] < self._base_top_m + self._reach_m
        if (
            low
            and position[2] - self._ground_below(position) < self._reach_m
            and self._dynamics.touches_ground()
        ):
            contacts = (*contacts, "base" if self._above_base(position) else "floor")
        return TrueState(
            self.time_us,
            position,
            flip_vector(sensors.velocity_ned_m_s),
            flip_quaternion(sensors.attitude),
            motors_on,
            contacts,
        )

    def motor_speeds_rad_s(self) -> MotorSpeeds:
        """True speeds of the rotors."""
        return self._dynamics.motor_speeds_rad_s()

    def _above_base(self, position_m: Vec3) -> bool:
        """Whether the base's top carries the drone: its centre is over the top and not below it.

        JSBSim knows one ground height for the whole drone. A drone whose centre of mass is beyond the
        edge would tip off, so the centre decides; the base's sides are a solid of their own.
        """
        x, y, z = position_m
        return z > self._base_level_m and is_over_base(self.scenario.base, x, y)

    def _ground_below(self, position_m: Vec3) -> float:
        return self._base_top_m if self._above_base(position_m) else 0.0

    def _near(self, position_m: Vec3) -> tuple[Solid, ...]:
        """Return the solids that could be touched within the next control period."""
        x, y, z = position_m
        near: tuple[Solid, ...] = ()
        for fx, fy, fz, reach, solids in self._groups:
            if -reach < x - fx < reach and -reach < y - fy < reach and -reach < z - fz < reach:
                near += tuple([solid for solid in solids if self._reaches(solid, position_m)])
        if z >= self._base_top_m + self._reach_m:
            return near
        bx, by, _ = self._base.centre_arena_m
        reach = self._base_reach_m
        beside = -reach < x - bx < reach and -reach < y - by < reach
        return (*near, self._base) if beside and not self._above_base(position_m) else near

    def _reaches(self, solid: Solid, position_m: Vec3) -> bool:
        """Whether the balls around a solid and the drone may meet within the next control period."""
        x, y, z = solid.centre_arena_m
        dx, dy, dz = position_m[0] - x, position_m[1] - y, position_m[2] - z
        reach = solid.reach_m + self._reach_m
        return dx * dx + dy * dy + dz * dz < reach * reach

    def _push_from(self, near: tuple[Solid, ...]) -> None:
        """Set force and moment of a spring, a damper and friction at each touch (penalty method)."""
        dynamics = self._dynamics
        position = flip_vector(dynamics.position_ned_m())
        rotation = _rotation(flip_quaternion(dynamics.attitude()))
        force, moment = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        touching: dict[Solid, Vec3] = {}
        for solid in near:
            found = touch(solid, position, rotation, self._half_m, self._touching.get(solid))
            if found is None:
                continue
            touching[solid] = found.normal_arena
            arm = _minus(found.point_arena_m, position)
            spin = _turn(rotation, flip_vector(dynamics.angular_rate_frd_rad_s()))
            velocity = _plus(flip_vector(dynamics.velocity_ned_m_s()), _cross(spin, arm))
            push = self._touch_force(found.depth_m, found.normal_arena, velocity)
            twist = _cross(arm, push)
            for i in range(3):
                force[i] += push[i]
                moment[i] += twist[i]
        self._touching = touching
        dynamics.push(
            flip_vector(_turn_back(rotation, (force[0], force[1], force[2]))),
            flip_vector(_turn_back(rotation, (moment[0], moment[1], moment[2]))),
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


def _rotation(quaternion: Quaternion) -> Matrix:
    w, x, y, z = quaternion
    return (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )


def _turn(m: Matrix, v: Vec3) -> Vec3:
    return (_dot(m[0], v), _dot(m[1], v), _dot(m[2], v))


def _turn_back(m: Matrix, v: Vec3) -> Vec3:
    return (
        m[0][0] * v[0] + m[1][0] * v[1] + m[2][0] * v[2],
        m[0][1] * v[0] + m[1][1] * v[1] + m[2][1] * v[2],
        m[0][2] * v[0] + m[1][2] * v[1] + m[2][2] * v[2],
    )


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
