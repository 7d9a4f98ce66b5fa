"""The state-space stabiliser: follows a velocity in level axes and a yaw rate.

The regulator's law u = -Kx x - Ki xi is written as nested loops, which changes nothing while no limit is
touched: the velocity part, divided by the gain on the angle, is the angle it asks for; the angle part,
divided by the gain on the rate, is the rate it asks for. So tilt and rates can be limited where they have a
meaning. The reference enters the proportional part with a weight (set-point weighting, Åström & Hägglund,
"Advanced PID Control", 2006, section 3.4), which quickens the response without moving a pole. Drag, which the
hover model leaves out, is cancelled from the airframe's numbers at the velocity flown (feedback
linearisation), so that stopping from speed behaves as starting does and the integrals need not learn it.
"""

from __future__ import annotations

from math import cos, hypot, sin

from firmware_py.airframe import GRAVITY_M_S2, Airframe
from firmware_py.control.design import Weights, design
from firmware_py.control.mixer import Mixer
from firmware_py.types import MotorOutput, RateCommand, VehicleState

_LEAST_COSINE = 0.5  # thrust is raised for tilt up to 60 degrees


class Stabiliser:
    """Holds the integrators; everything else is the gains of `design`.

    Args:
        airframe: the numbers to design from.
        period_s: time between calls of `step`.
        weights: of the regulator.
        horizontal_reference_weight: how much of a horizontal reference acts at once (0..1).
        vertical_reference_weight: the same for the vertical.
        yaw_reference_weight: the same for the yaw rate.
    """

    def __init__(
        self,
        airframe: Airframe,
        period_s: float,
        weights: Weights | None = None,
        *,
        horizontal_reference_weight: float = 0.6,
        vertical_reference_weight: float = 0.8,
        yaw_reference_weight: float = 0.8,
    ) -> None:
        gains = design(airframe, period_s, weights)
        kx, ki = gains.kx, gains.ki
        self._period_s = period_s
        self._mixer = Mixer(airframe)
        self._weight_n = airframe.weight_n
        self._tilt_limit_rad = airframe.limits.tilt_rad
        self._rate_limit_rad_s = airframe.limits.roll_pitch_rate_rad_s
        self._max_squared = airframe.motor.max_speed_rad_s**2
        self._idle = MotorOutput(self._mixer.mix(0.0, 0.0, 0.0, 0.0).speeds_rad_s)
        self._drag = airframe.drag.force_n_s2_m2
        self._b_horizontal = horizontal_reference_weight
        self._b_vertical = vertical_reference_weight
        self._b_yaw = yaw_reference_weight
        # Roll about forward answers v_right, pitch about right answers v_forward (nose down: forward).
        self._roll = _Tilt(float(kx[1, 0]), float(kx[1, 2]), float(kx[1, 6]), float(ki[1, 1]))
        self._pitch = _Tilt(float(kx[2, 1]), float(kx[2, 3]), float(kx[2, 5]), float(ki[2, 0]))
        self._k_down, self._ki_down = float(kx[0, 7]), float(ki[0, 2])
        self._k_yaw, self._ki_yaw = float(kx[3, 4]), float(ki[3, 3])
        self._xi_down = 0.0
        self._xi_yaw = 0.0

    def reset(self) -> None:
        """Forget all integrals: at arming and on the ground."""
        self._roll.xi = self._pitch.xi = self._xi_down = self._xi_yaw = 0.0

    def idle(self) -> MotorOutput:
        """Return motors turning slowly, as an armed drone's do on the ground."""
        return self._idle

    def step(self, state: VehicleState, command: RateCommand, *, grounded: bool = False) -> MotorOutput:
        """Return the motor commands for one control period.

        Args:
            state: the vehicle now.
            command: what to follow.
            grounded: it still stands on something; integrals are held so that they do not wind up.
        """
        north, east, down = state.velocity_ned_m_s
        cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
        forward, right = cos_yaw * north + sin_yaw * east, cos_yaw * east - sin_yaw * north
        want_forward, want_right, want_down = command.velocity_level_m_s
        p, q, r = state.angular_rate_frd_rad_s
        period_s = 0.0 if grounded else self._period_s

        # The level axes turn with the yaw: to keep a velocity in them takes the centripetal tilt.
        turn = r / GRAVITY_M_S2
        drag_forward, drag_right, drag_down = self._drag
        roll = self._roll.angle(right, want_right, self._b_horizontal, period_s) + turn * forward
        roll += drag_right * right * abs(right) / self._weight_n
        pitch = self._pitch.angle(forward, want_forward, self._b_horizontal, period_s) + turn * right
        pitch -= drag_forward * forward * abs(forward) / self._weight_n
        tilt = hypot(roll, pitch)
        if tilt > self._tilt_limit_rad:
            scale = self._tilt_limit_rad / tilt
            roll, pitch = roll * scale, pitch * scale
            self._roll.hold(right - want_right, period_s)
            self._pitch.hold(forward - want_forward, period_s)
        limit = self._rate_limit_rad_s
        roll_nm = self._roll.moment(roll, state.roll_rad, p, limit)
        pitch_nm = self._pitch.moment(pitch, state.pitch_rad, q, limit)

        error_down = down - want_down
        error_yaw = r - command.yaw_rate_rad_s
        self._xi_down += error_down * period_s
        self._xi_yaw += error_yaw * period_s
        lift_n = self._weight_n - drag_down * down * abs(down)
        lift_n -= self._k_down * (down - self._b_vertical * want_down) + self._ki_down * self._xi_down
        thrust_n = max(lift_n, 0.0) / max(cos(state.roll_rad) * cos(state.pitch_rad), _LEAST_COSINE)
        yaw_nm = -self._k_yaw * (r - self._b_yaw * command.yaw_rate_rad_s) - self._ki_yaw * self._xi_yaw

        mixed = self._mixer.mix(thrust_n, roll_nm, pitch_nm, yaw_nm)
        # Anti-windup: an integral does not grow in the direction the motors cannot follow.
        if (mixed.thrust_high and error_down > 0) or (mixed.thrust_low and error_down < 0):
            self._xi_down -= error_down * period_s
        if mixed.yaw_cut and (error_yaw < 0) == (yaw_nm > 0):
            self._xi_yaw -= error_yaw * period_s
        speeds = mixed.speeds_rad_s
        squares = 0.0
        for speed in speeds:
            squares += speed * speed
        throttle = squares / (len(speeds) * self._max_squared)
        return MotorOutput(speeds, throttle, mixed.thrust_high or mixed.thrust_low or mixed.yaw_cut)


class _Tilt:
    """One horizontal axis: velocity to angle to rate to moment, with its integral `xi`."""

    __slots__ = ("_k_angle", "_k_rate", "_k_velocity", "_ki", "xi")

    def __init__(self, k_angle: float, k_rate: float, k_velocity: float, ki: float) -> None:
        self._k_angle = k_angle
        self._k_rate = k_rate
        self._k_velocity = k_velocity / k_angle
        self._ki = ki / k_angle
        self.xi = 0.0

    def angle(self, velocity: float, wanted: float, weight: float, period_s: float) -> float:
        """Integrate the error and return the angle asked for, rad."""
        self.xi += (velocity - wanted) * period_s
        return -self._k_velocity * (velocity - weight * wanted) - self._ki * self.xi

    def hold(self, error: float, period_s: float) -> None:
        """Take the last step of the integral back, unless it leads out of the limit."""
        if (self._ki * self.xi > 0) == (self._ki * error > 0):
            self.xi -= error * period_s

    def moment(self, angle: float, measured: float, rate: float, rate_limit: float) -> float:
        """Return the moment that turns the body to an angle, N m."""
        wanted_rate = self._k_angle * (angle - measured) / self._k_rate
        if wanted_rate > rate_limit:
            wanted_rate = rate_limit
        elif wanted_rate < -rate_limit:
            wanted_rate = -rate_limit
        return self._k_rate * (wanted_rate - rate)
