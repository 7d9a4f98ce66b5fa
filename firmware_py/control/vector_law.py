"""The vector law: turns the thrust vector to the desired acceleration, at any tilt.

The regulator's nested loops (`design_bandwidths`) with exact geometry between them: a velocity error gives a
desired acceleration; with gravity, the declared drag and the learnt force it gives the thrust vector, limited
in tilt with priority for its vertical part (as in PX4's position control); the body's down axis turns there
by the shortest rotation; body rates follow. So it equals the linear design near hover.
"""

from __future__ import annotations

from math import cos, sin, sqrt

from firmware_py.commands import (
    AccelerationCommand,
    AttitudeCommand,
    BodyRateCommand,
    ControlCommand,
    FlightLimits,
    MotorCommand,
    TiltCommand,
    VelocityFrdCommand,
)
from firmware_py.control.design import design_bandwidths
from firmware_py.control.mixer import Mixer
from firmware_py.types import MotorOutput, VehicleState
from framerunner.geometry.rotations import Rotation, rotation, tilt_error, to_body, to_world
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.airframe import GRAVITY_M_S2, Airframe

_MIN_COSINE = 0.5  # thrust is raised for tilt up to 60 degrees, and decreases to none from there to 90
_MIN_LIFT = 0.2  # share of the weight: a thrust for attitude control in descent, if MPC_THR_MIN is not less
_MAX_THRUST = 0.92  # share of full thrust for following a velocity; the rest is for attitude control
_MAX_FORCE_M_S2 = GRAVITY_M_S2  # greatest acceleration learnt: the ground's reaction at landing
_MAX_MOMENT_RAD_S2 = 20.0
_TURN_LEARNT = 0.04  # per step: within a tenth of a second
_MIN_TURN = 1e-5  # speed^2 x turn^2 x period, a centripetal acceleration of 0.05 m/s^2

_Target = tuple[float, float, float, float]
"""The thrust in N and body rates in rad/s that a command needs."""


class DisturbanceObserver:
    """Estimates an unknown acceleration `d` per axis from a velocity and the expected acceleration `a`.

    A Luenberger observer of v' = a + d, d' = 0 with both poles at one bandwidth (Franklin, Powell & Workman,
    "Digital Control of Dynamic Systems", 1998, section 8.5). Subtracting d from the desired acceleration is
    integral action that cannot wind up, because `a` is the acceleration within all limits; and it does not
    depend on which command is followed.

    Args:
        bandwidth_rad_s: of both poles.
        period_s: time between corrections.
        limit: bound of |d|, per axis.
    """

    def __init__(self, bandwidth_rad_s: float, period_s: float, limit: float) -> None:
        self._period_s = period_s
        self._gain = 2.0 * bandwidth_rad_s * period_s
        self._gain_d = bandwidth_rad_s**2 * period_s
        self._limit = limit
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._x = self._y = self._z = 0.0
        self._fresh = True
        self.d: Vec3 = (0.0, 0.0, 0.0)

    def hold(self, velocity: Vec3) -> None:
        """Learn nothing in this period, in which the ground may carry the vehicle."""
        self._x, self._y, self._z = velocity
        self._fresh = False

    def correct(self, velocity: Vec3) -> None:
        """Compare the velocity with the one predicted; update `d`."""
        if self._fresh:
            self.hold(velocity)
            return
        x, y, z = velocity
        x, y, z = x - self._x, y - self._y, z - self._z
        gain, gain_d, limit = self._gain, self._gain_d, self._limit
        self._x += gain * x
        self._y += gain * y
        self._z += gain * z
        dx, dy, dz = self.d
        dx, dy, dz = dx + gain_d * x, dy + gain_d * y, dz + gain_d * z
        if max(dx, dy, dz, -dx, -dy, -dz) > limit:
            dx, dy, dz = (max(-limit, min(limit, value)) for value in (dx, dy, dz))
        self.d = (dx, dy, dz)

    def predict(self, x: float, y: float, z: float) -> None:
        """Integrate the acceleration expected from the motor commands over one period."""
        dx, dy, dz = self.d
        period_s = self._period_s
        self._x += (x + dx) * period_s
        self._y += (y + dy) * period_s
        self._z += (z + dz) * period_s


class VectorLaw:
    """The nested loops of `design_bandwidths`, two observers and the lag of the motors.

    Args:
        airframe: what flies.
        period_s: time between calls of `step`.
        limits: may change in flight.
        mixer: of that airframe.
    """

    def __init__(self, airframe: Airframe, period_s: float, limits: FlightLimits, mixer: Mixer) -> None:
        weights, loops = airframe.stabiliser, design_bandwidths(airframe, period_s)
        self._k_velocity, self._k_attitude, self._k_rate = loops.velocity_level, loops.attitude, loops.rate
        self._limits = limits
        self._mixer = mixer
        self._mass_kg = mass = airframe.mass_kg
        self._inertia = airframe.inertia_kg_m2
        forward, right, down = airframe.drag.force_n_s2_m2
        self._drag = (forward / mass, right / mass, down / mass)
        self._drag_moment = airframe.drag.moment_nm_s2
        self._full_n = airframe.full_thrust_n
        self._full_lift = self._full_n / mass
        self._rate_limit_rad_s = airframe.limits.roll_pitch_rate_rad_s
        self._max_speed_rad_s = airframe.motor.max_speed_rad_s
        self._rotors = len(airframe.rotors)
        self._force = DisturbanceObserver(weights.observer_force_rad_s, period_s, _MAX_FORCE_M_S2)
        self._moment = DisturbanceObserver(weights.observer_moment_rad_s, period_s, _MAX_MOMENT_RAD_S2)
        self._lag = period_s / (period_s + airframe.motor.time_constant_s)
        self._wrench = (airframe.weight_n, 0.0, 0.0, 0.0)  # thrust and moments now, with the motors' lag
        self._hover_n = airframe.weight_n
        self._period_s = period_s
        self._wanted = (0.0, 0.0)  # desired velocity in the last step, north and east
        self._turning = 0.0  # share of the commanded turn by which the desired velocity turns, 0..1

    def reset(self) -> None:
        """Forget what was learnt: at arming and on the ground."""
        self._force.reset()
        self._moment.reset()
        self._wrench = (self._hover_n, 0.0, 0.0, 0.0)
        self._turning = 0.0

    def enter(self, state: VehicleState) -> None:
        """Take over in flight from another law."""
        self.reset()

    def leave(self, state: VehicleState) -> None:
        """Hand over in flight; `enter` forgets what was learnt."""

    def step(self, state: VehicleState, command: ControlCommand, grounded: bool) -> MotorOutput:
        """Return the motor commands for one control period.

        Args:
            state: of the vehicle now.
            command: what to follow.
            grounded: the vehicle still touches the ground; nothing is learnt, or its reaction would be.
        """
        velocity, rates = state.velocity_ned_m_s, state.angular_rate_frd_rad_s
        if grounded:
            self._force.hold(velocity)
            self._moment.hold(rates)
        else:
            self._force.correct(velocity)
            self._moment.correct(rates)
        m = rotation(state.attitude)
        drag = self._drag_ned(m, velocity)
        p, q, r = rates
        i_roll, i_pitch, i_yaw = self._inertia
        # Moments of the rotation itself, by Euler's equations and the declared drag, N m.
        drag_roll, drag_pitch, drag_yaw = self._drag_moment
        own_roll = (i_yaw - i_pitch) * q * r + drag_roll * p * abs(p)
        own_pitch = (i_roll - i_yaw) * p * r + drag_pitch * q * abs(q)
        own_yaw = (i_pitch - i_roll) * p * q + drag_yaw * r * abs(r)
        if type(command) is MotorCommand:
            output = self._motor_output(command)
            wrench = self._mixer.wrench(output.speeds_rad_s)
        else:
            thrust_n, want_p, want_q, want_r = self._target(state, command, m, drag)
            k_roll, k_pitch, k_yaw = self._k_rate
            d_roll, d_pitch, d_yaw = self._moment.d
            roll_nm = i_roll * (k_roll * (want_p - p) - d_roll) + own_roll
            pitch_nm = i_pitch * (k_pitch * (want_q - q) - d_pitch) + own_pitch
            yaw_nm = i_yaw * (k_yaw * (want_r - r) - d_yaw) + own_yaw
            output = self._mixer.mix(thrust_n, roll_nm, pitch_nm, yaw_nm)
            wrench = (thrust_n, roll_nm, pitch_nm, yaw_nm)
            if output.thrust_high or output.thrust_low or output.yaw_cut:
                wrench = self._mixer.wrench(output.speeds_rad_s)

        lag = self._lag
        thrust, roll, pitch, yaw = self._wrench
        thrust += lag * (wrench[0] - thrust)
        roll += lag * (wrench[1] - roll)
        pitch += lag * (wrench[2] - pitch)
        yaw += lag * (wrench[3] - yaw)
        self._wrench = (thrust, roll, pitch, yaw)
        lift = thrust / self._mass_kg
        self._force.predict(
            drag[0] - lift * m[2], drag[1] - lift * m[5], drag[2] - lift * m[8] + GRAVITY_M_S2
        )
        self._moment.predict(
            (roll - own_roll) / i_roll, (pitch - own_pitch) / i_pitch, (yaw - own_yaw) / i_yaw
        )
        return output

    def _target(self, state: VehicleState, command: ControlCommand, m: Rotation, drag: Vec3) -> _Target:
        if type(command) is VelocityFrdCommand:
            return self._follow_velocity(state, command, m, drag)
        if type(command) is AccelerationCommand:
            forward, right, down = command.acceleration_level_m_s2
            return self._point(state, (forward, right, GRAVITY_M_S2 - down), m, command.yaw_rate_rad_s)
        if type(command) is TiltCommand:
            error = command.down_m_s - state.velocity_ned_m_s[2]
            below = self._k_velocity[2] * error - drag[2] - self._force.d[2]
            thrust_n = self._thrust(self._lift(GRAVITY_M_S2 - below), m)
            return self._hold_tilt(state, command, thrust_n, m)
        if type(command) is AttitudeCommand:
            return self._hold_tilt(state, command, command.thrust * self._full_n, m)
        if type(command) is BodyRateCommand:
            p, q, r = command.rate_frd_rad_s
            return (command.thrust * self._full_n if command.thrust > 0.0 else 0.0, p, q, r)  # NaN: 0
        raise TypeError(f"not a command of the stabiliser: {type(command).__name__}")

    def _follow_velocity(
        self, state: VehicleState, command: VelocityFrdCommand, m: Rotation, drag: Vec3
    ) -> _Target:
        north, east, down = state.velocity_ned_m_s
        cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
        forward, right = cos_yaw * north + sin_yaw * east, cos_yaw * east - sin_yaw * north
        want_forward, want_right, want_down = command.velocity_level_m_s
        ahead, aside, below = command.acceleration_level_m_s2
        k_forward, k_right, k_down = self._k_velocity
        turn = self._turn_of(
            cos_yaw * want_forward - sin_yaw * want_right,
            sin_yaw * want_forward + cos_yaw * want_right,
            command.yaw_rate_rad_s,
        )
        d_north, d_east, d_down = self._force.d
        push_north, push_east = drag[0] + d_north, drag[1] + d_east
        ahead += k_forward * (want_forward - forward) - turn * right
        ahead -= cos_yaw * push_north + sin_yaw * push_east
        aside += k_right * (want_right - right) + turn * forward
        aside -= cos_yaw * push_east - sin_yaw * push_north
        below += k_down * (want_down - down) - drag[2] - d_down
        return self._point(state, (ahead, aside, GRAVITY_M_S2 - below), m, command.yaw_rate_rad_s)

    def _turn_of(self, north: float, east: float, yaw_rate_rad_s: float) -> float:
        """How fast the desired velocity turns with the yaw, rad/s, for its centripetal acceleration.

        A velocity that is constant in level axes turns with them; one that is constant in NED does not. The
        share of the commanded turn, 0..1, is estimated from the velocity's change in NED.
        """
        before_north, before_east = self._wanted
        self._wanted = (north, east)
        size = (north * north + east * east) * yaw_rate_rad_s * self._period_s
        if size * yaw_rate_rad_s < _MIN_TURN:
            return 0.0
        part = (north * (east - before_east) - east * (north - before_north)) / size
        self._turning += _TURN_LEARNT * (max(0.0, min(part, 1.0)) - self._turning)
        return self._turning * yaw_rate_rad_s

    def _hold_tilt(
        self, state: VehicleState, command: TiltCommand | AttitudeCommand, thrust_n: float, m: Rotation
    ) -> _Target:
        """Tilt and thrust as commanded; the limit of tilt holds only for accelerations."""
        cos_roll = cos(command.roll_rad)
        down_level = (
            sin(command.pitch_rad) * cos_roll,
            -sin(command.roll_rad),
            cos(command.pitch_rad) * cos_roll,
        )
        return (thrust_n, *self._turn_to(state, down_level, m, command.yaw_rate_rad_s))

    def _point(self, state: VehicleState, specific: Vec3, m: Rotation, yaw_rate_rad_s: float) -> _Target:
        """Turn to a thrust per mass, m/s^2, given as forward, right and up in level axes; up has priority."""
        ahead, aside, up = specific
        up = self._lift(up)
        room = min(up * self._limits.tilt_tangent, sqrt(max(self._max_lift() ** 2 - up * up, 0.0)))
        level = sqrt(ahead * ahead + aside * aside)
        if level > room:
            ahead, aside, level = ahead * room / level, aside * room / level, room
        length = sqrt(level * level + up * up)
        if length == 0.0:  # free fall, if MPC_THR_MIN is 0: upright, as no thrust has a direction
            return (0.0, *self._turn_to(state, (0.0, 0.0, 1.0), m, yaw_rate_rad_s))
        down_level = (-ahead / length, -aside / length, up / length)
        return (self._thrust(up, m), *self._turn_to(state, down_level, m, yaw_rate_rad_s))

    def _lift(self, up: float) -> float:
        """Vertical thrust per mass within its limits, m/s^2."""
        lowest = min(_MIN_LIFT * GRAVITY_M_S2, self._limits.min_thrust * self._full_lift)
        return max(lowest, min(up, self._max_lift()))

    def _max_lift(self) -> float:
        return min(_MAX_THRUST, self._limits.max_thrust) * self._full_lift

    def _thrust(self, up: float, m: Rotation) -> float:
        """Thrust along the body's axis at its present tilt for a vertical thrust per mass, N."""
        cosine = m[8]
        if cosine < _MIN_COSINE:
            return self._mass_kg * up * max(cosine, 0.0) / _MIN_COSINE**2
        return self._mass_kg * up / cosine

    def _turn_to(self, state: VehicleState, down_level: Vec3, m: Rotation, yaw_rate_rad_s: float) -> Vec3:
        """Body rates that turn body down to a unit vector in level axes, with a yaw rate about world down."""
        cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
        x, y, z = down_level
        roll, pitch = tilt_error(m, (cos_yaw * x - sin_yaw * y, sin_yaw * x + cos_yaw * y, z))
        p, q = self._k_attitude[0] * roll, self._k_attitude[1] * pitch
        rate = sqrt(p * p + q * q)
        max_rad_s = min(self._rate_limit_rad_s, self._limits.rate_rad_s)
        if rate > max_rad_s:
            p, q = p * max_rad_s / rate, q * max_rad_s / rate
        # When rolled, a pitch rate also turns the heading, by its share of world down; yaw compensates it.
        # Otherwise a velocity constant in level axes would feed back into the pitch that it commands.
        r = -q * m[7] / max(m[8], _MIN_COSINE)
        return (p + m[6] * yaw_rate_rad_s, q + m[7] * yaw_rate_rad_s, r + m[8] * yaw_rate_rad_s)

    def _drag_ned(self, m: Rotation, velocity_ned: Vec3) -> Vec3:
        """Acceleration by the declared drag in still air, NED, m/s^2."""
        forward, right, down = self._drag
        x, y, z = to_body(m, *velocity_ned)
        return to_world(m, -forward * x * abs(x), -right * y * abs(y), -down * z * abs(z))

    def _motor_output(self, command: MotorCommand) -> MotorOutput:
        outputs = [min(value, 1.0) if value > 0.0 else 0.0 for value in command.outputs]  # NaN: off
        outputs = (outputs + [0.0] * self._rotors)[: self._rotors]
        speeds = tuple([self._max_speed_rad_s * sqrt(value) for value in outputs])
        return MotorOutput(speeds, sum(outputs) / self._rotors)
