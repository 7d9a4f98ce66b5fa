"""The level law: follows a velocity in level axes and a yaw rate, for airframes that tilt little.

The regulator's law u = -Kx x - Ki xi is written as nested loops, which changes nothing while no limit is
reached: the velocity part divided by the gain of the angle is the desired angle; the angle part divided by
the gain of the rate is the desired rate. So tilt and rates can be limited. The reference enters the
proportional part with a weight (set-point weighting, Åström & Hägglund, "Advanced PID Control", 2006,
section 3.4), which quickens the response without moving a pole. Drag, which the hover model leaves out, is
cancelled from the airframe's numbers at the current velocity (feedback linearisation), so that braking
behaves as accelerating does and the integrals need not compensate it.

Angles are used for their sines, which is accurate up to about 35 degrees; beyond that `vector_law` is used.
"""

from __future__ import annotations

from math import cos, sin, sqrt

from firmware_py.commands import FlightLimits, VelocityFrdCommand
from firmware_py.control.design import design
from firmware_py.control.mixer import Mixer
from firmware_py.types import MotorOutput, VehicleState
from framerunner.geometry.vectors import ZERO3
from framerunner.vehicle.airframe import GRAVITY_M_S2, Airframe

_MIN_COSINE = 0.5  # thrust is raised for tilt up to 60 degrees
# How much of a reference acts at once, 0..1.
_WEIGHT_HORIZONTAL = 0.5
_WEIGHT_VERTICAL = 0.8
_WEIGHT_YAW = 0.8


class LevelLaw:
    """The gains of `design`, and the integrals.

    Args:
        airframe: what flies.
        period_s: time between calls of `step`.
        limits: may change in flight.
        mixer: of that airframe.
    """

    def __init__(self, airframe: Airframe, period_s: float, limits: FlightLimits, mixer: Mixer) -> None:
        gains = design(airframe, period_s)
        kx, ki = gains.kx, gains.ki
        self._period_s = period_s
        self._limits = limits
        self._mixer = mixer
        self._mass_kg = airframe.mass_kg
        self._weight_n = airframe.weight_n
        forward, right, down = airframe.drag.force_n_s2_m2
        self._drag_share = (forward / self._weight_n, right / self._weight_n, down / self._weight_n)
        # Roll about forward controls v_right, pitch about right controls v_forward (nose down: forward).
        limit_rad_s = airframe.limits.roll_pitch_rate_rad_s
        roll = (float(kx[1, 0]), float(kx[1, 2]), float(kx[1, 6]), float(ki[1, 1]))
        pitch = (float(kx[2, 1]), float(kx[2, 3]), float(kx[2, 5]), float(ki[2, 0]))
        self._roll = _Tilt(roll, limit_rad_s)
        self._pitch = _Tilt(pitch, limit_rad_s)
        self._k_down, self._ki_down = float(kx[0, 7]), float(ki[0, 2])
        self._k_yaw, self._ki_yaw = float(kx[3, 4]), float(ki[3, 3])
        self._xi_down = 0.0
        self._xi_yaw = 0.0

    def reset(self) -> None:
        """Set all integrals to zero: at arming and on the ground."""
        self._roll.xi = self._pitch.xi = self._xi_down = self._xi_yaw = 0.0

    def enter(self, state: VehicleState) -> None:
        """Take over in flight, with the integrals kept by `leave` and in equilibrium at the velocity now."""
        self._shift(state, 1.0)

    def leave(self, state: VehicleState) -> None:
        """Hand over in flight: keep only what the integrals have learnt of disturbances."""
        self._shift(state, -1.0)

    def _shift(self, state: VehicleState, sign: float) -> None:
        """Add or subtract the integrals' values at a steady velocity without disturbance.

        There they replace the part of the reference that does not act at once: 0 = k (v - b v) + ki xi.
        """
        north, east, down = state.velocity_ned_m_s
        cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
        self._roll.xi += sign * self._roll.steady(cos_yaw * east - sin_yaw * north)
        self._pitch.xi += sign * self._pitch.steady(cos_yaw * north + sin_yaw * east)
        self._xi_down -= sign * self._k_down * (1.0 - _WEIGHT_VERTICAL) * down / self._ki_down
        r = state.angular_rate_frd_rad_s[2]
        self._xi_yaw -= sign * self._k_yaw * (1.0 - _WEIGHT_YAW) * r / self._ki_yaw

    def step(self, state: VehicleState, command: VelocityFrdCommand, grounded: bool) -> MotorOutput:
        """Return the motor commands for one control period.

        Args:
            state: of the vehicle now.
            command: what to follow.
            grounded: the vehicle still touches the ground; integrals are held so that they do not wind up.
        """
        north, east, down = state.velocity_ned_m_s
        cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
        forward, right = cos_yaw * north + sin_yaw * east, cos_yaw * east - sin_yaw * north
        want_forward, want_right, want_down = command.velocity_level_m_s
        p, q, r = state.angular_rate_frd_rad_s
        period_s = 0.0 if grounded else self._period_s

        # The level axes turn with the yaw: a constant velocity in them needs a centripetal tilt.
        turn = r / GRAVITY_M_S2
        drag_forward, drag_right, drag_down = self._drag_share
        roll_axis, pitch_axis = self._roll, self._pitch
        roll = roll_axis.angle(right, want_right, period_s)
        roll += turn * forward + drag_right * right * abs(right)
        pitch = pitch_axis.angle(forward, want_forward, period_s)
        pitch += turn * right - drag_forward * forward * abs(forward)
        below = 0.0
        if command.acceleration_level_m_s2 != ZERO3:
            ahead, aside, below = command.acceleration_level_m_s2
            roll += aside / GRAVITY_M_S2
            pitch -= ahead / GRAVITY_M_S2
        tilt_squared = self._limits.tilt_squared
        if roll * roll + pitch * pitch > tilt_squared:
            scale = sqrt(tilt_squared / (roll * roll + pitch * pitch))
            roll, pitch = roll * scale, pitch * scale
            roll_axis.hold(right - want_right, period_s)
            pitch_axis.hold(forward - want_forward, period_s)
        roll_rad, pitch_rad = state.roll_rad, state.pitch_rad
        roll_nm = roll_axis.moment(roll - roll_rad, p)
        pitch_nm = pitch_axis.moment(pitch - pitch_rad, q)

        error_down = down - want_down
        want_yaw = command.yaw_rate_rad_s
        error_yaw = r - want_yaw
        self._xi_down += error_down * period_s
        self._xi_yaw += error_yaw * period_s
        lift_n = self._weight_n * (1.0 - drag_down * down * abs(down))
        lift_n -= self._k_down * (down - _WEIGHT_VERTICAL * want_down) + self._ki_down * self._xi_down
        lift_n -= self._mass_kg * below
        cosine = cos(roll_rad) * cos(pitch_rad)
        thrust_n = lift_n / (cosine if cosine > _MIN_COSINE else _MIN_COSINE) if lift_n > 0.0 else 0.0
        yaw_nm = -self._k_yaw * (r - _WEIGHT_YAW * want_yaw) - self._ki_yaw * self._xi_yaw

        output = self._mixer.mix(thrust_n, roll_nm, pitch_nm, yaw_nm)
        # Anti-windup: an integral does not grow in a direction that the motors cannot follow.
        if (output.thrust_high and error_down > 0) or (output.thrust_low and error_down < 0):
            self._xi_down -= error_down * period_s
        if output.yaw_cut and (error_yaw < 0) == (yaw_nm > 0):
            self._xi_yaw -= error_yaw * period_s
        return output


class _Tilt:
    """One horizontal axis: velocity to angle to rate to moment, with its integral `xi`.

    Args:
        gains: of the angle, the rate, the velocity and its integral, as in u = -K x.
        rate_limit_rad_s: of the desired rate.
    """

    def __init__(self, gains: tuple[float, float, float, float], rate_limit_rad_s: float) -> None:
        self._k_angle, self._k_rate, k_velocity, ki = gains
        self._k_velocity = k_velocity / self._k_angle
        self._ki = ki / self._k_angle
        self._limit_nm = self._k_rate * rate_limit_rad_s  # the moment for a rate at its limit
        self.xi = 0.0

    def steady(self, velocity: float) -> float:
        """The integral at which this velocity, if commanded, needs no angle."""
        return -self._k_velocity * (1.0 - _WEIGHT_HORIZONTAL) * velocity / self._ki

    def angle(self, velocity: float, wanted: float, period_s: float) -> float:
        """Integrate the error and return the desired angle, rad."""
        self.xi = xi = self.xi + (velocity - wanted) * period_s
        return -self._k_velocity * (velocity - _WEIGHT_HORIZONTAL * wanted) - self._ki * xi

    def hold(self, error: float, period_s: float) -> None:
        """Undo the last step of the integral, unless it leads back below the limit."""
        if (self._ki * self.xi > 0) == (self._ki * error > 0):
            self.xi -= error * period_s

    def moment(self, error_rad: float, rate: float) -> float:
        """Return the moment that reduces an angle's error, N m."""
        wanted_nm = self._k_angle * error_rad
        limit_nm = self._limit_nm
        if wanted_nm > limit_nm:
            wanted_nm = limit_nm
        elif wanted_nm < -limit_nm:
            wanted_nm = -limit_nm
        return wanted_nm - self._k_rate * rate
