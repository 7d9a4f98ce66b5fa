"""The filter of the drone's place: an extended Kalman filter over the drone and the gates that it has seen.

The state is the drone's position and velocity in the arena, the angle by which its reported heading is wrong,
the accelerometer's bias, and for each gate x, y, z and yaw: simultaneous localisation and mapping
(Durrant-Whyte & Bailey, IEEE Robotics & Automation Magazine 13(2), 2006). Roll and pitch are taken as
reported: the vehicle's own filter knows them by gravity to a fraction of a degree, and what is left acts like
a bias.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import cos, inf, radians, sin, sqrt
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from framerunner.geometry.rotations import to_world
from framerunner.geometry.vectors import Vec3
from offboard.place.inertial_track import InertialMotion

Floats: TypeAlias = npt.NDArray[np.float64]

POSITION, TURN, VELOCITY, BIAS, OWN = slice(0, 3), 3, slice(4, 7), slice(7, 10), 10
GATE = 4  # numbers of a gate

# Noise, as densities and random walks per root of a second: of a small IMU on a vibrating drone, whose
# reported roll and pitch are wrong by tenths of a degree.
ACCEL_M_S2 = 0.027
BIAS_M_S2 = 0.01
TURN_RAD = radians(0.25)  # of the reported heading
TURN_SETTLING_RAD = radians(1.2)  # likewise while the vehicle corrects it after leaving the ground
GYRO_RAD = radians(0.2)  # of a heading by gyroscope alone: its bias, its scale

START_POSITION_M = 0.003
START_VELOCITY_M_S = 0.02
START_TURN_RAD = radians(1.0)
START_BIAS_M_S2 = 0.05
_EYE = np.eye(OWN)
_MOVED = np.zeros((OWN, OWN))  # how velocity moves the position
_MOVED[POSITION, VELOCITY] = np.eye(3)
_BY_TIME = np.diag([0.0] * 4 + [ACCEL_M_S2**2] * 3 + [BIAS_M_S2**2] * 3)  # noise that grows with time,
_BY_TIME_2 = ACCEL_M_S2**2 / 2.0 * (_MOVED + _MOVED.T)  # its square,
_BY_TIME_3 = ACCEL_M_S2**2 / 3.0 * (_MOVED @ _MOVED.T)  # and its cube
ITERATIONS = 5
MOVED = 0.005  # metres or radians: where the state moves less, linearising anew changes nothing


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """What a measurement says at a state.

    Attributes:
        residual: measured less expected, shape (m,).
        jacobian: of what is expected by the state, shape (m, n).
        noise: covariance of the measured, shape (m, m).
    """

    residual: Floats
    jacobian: Floats
    noise: Floats


Model = Callable[[Floats], Measurement | None]
"""The measurement at a state; None if it cannot be made there."""


class PlaceFilter:
    """An extended Kalman filter; it does not read the clock.

    Args:
        time_us: vehicle time.
        position_m: of the drone, arena axes.
        velocity_m_s: likewise.
        position_std_m: of each coordinate.
        velocity_std_m_s: likewise.

    Attributes:
        time_us: of the state.
        x: the state, shape (10 + 4 gates,).
        p: its covariance.
        gates: the first index of each gate, by colour.
    """

    def __init__(
        self,
        time_us: int,
        position_m: Vec3,
        velocity_m_s: Vec3,
        *,
        position_std_m: float = START_POSITION_M,
        velocity_std_m_s: float = START_VELOCITY_M_S,
    ) -> None:
        self.time_us = time_us
        self.x = np.array((*position_m, 0.0, *velocity_m_s, 0.0, 0.0, 0.0))
        stds = [position_std_m] * 3 + [START_TURN_RAD] + [velocity_std_m_s] * 3 + [START_BIAS_M_S2] * 3
        self.p = np.diag(np.square(stds))
        self.gates: dict[str, int] = {}

    @property
    def turn_rad(self) -> float:
        """What must be added to the reported heading."""
        return float(self.x[TURN])

    def position_std_m(self, time_us: int) -> float:
        """Standard deviation of the position at a time, of the coordinate known worst."""
        variances, later_s = self.p.diagonal(), (time_us - self.time_us) * 1e-6
        return sqrt((variances[POSITION] + later_s**2 * variances[VELOCITY]).max())

    def turned_rad(self, motion: InertialMotion, *, settling: bool) -> float:
        """The turn after a motion: that of the reported heading and of the gyroscope, by their noise."""
        reported, gyro = (TURN_SETTLING_RAD if settling else TURN_RAD) ** 2, GYRO_RAD**2
        return self.turn_rad + motion.turn_rad * reported / (reported + gyro)

    def moved(self, motion: InertialMotion) -> tuple[Vec3, Vec3]:
        """Position and velocity after a motion; the state stays."""
        px, py, pz, turn_rad, vx, vy, vz, bx, by, bz = self.x[:OWN].tolist()
        c, s, step_s = cos(turn_rad), sin(turn_rad), motion.duration_s
        gx, gy, gz = to_world(motion.attitude, bx, by, bz)
        gx, gy = c * gx - s * gy, s * gx + c * gy
        (ux, uy, uz), (dx, dy, dz) = motion.velocity_m_s, motion.position_m
        half = 0.5 * step_s**2
        velocity = (
            vx + c * ux - s * uy - step_s * gx,
            vy + s * ux + c * uy - step_s * gy,
            vz + uz - step_s * gz,
        )
        position = (
            px + step_s * vx + c * dx - s * dy - half * gx,
            py + step_s * vy + s * dx + c * dy - half * gy,
            pz + step_s * vz + dz - half * gz,
        )
        return position, velocity

    def predict(self, motion: InertialMotion, *, settling: bool = False) -> None:
        """Let the time of a motion pass.

        Covariance of a double integrator driven by white noise: Bar-Shalom, Li & Kirubarajan, "Estimation
        with Applications to Tracking and Navigation", 2001, 6.2.2.

        Args:
            motion: since the state.
            settling: the vehicle may just be correcting its heading.
        """
        position, velocity = self.moved(motion)
        step_s = motion.duration_s
        c, s = cos(self.x[TURN]), sin(self.x[TURN])
        turn = np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))
        body = turn @ np.array(motion.attitude).reshape(3, 3)
        by_force = position - self.x[POSITION] - step_s * self.x[VELOCITY]
        gained = velocity - self.x[VELOCITY]
        f = _EYE + step_s * _MOVED
        f[POSITION, TURN] = (-by_force[1], by_force[0], 0.0)
        f[POSITION, BIAS] = -0.5 * step_s**2 * body
        f[VELOCITY, TURN] = (-gained[1], gained[0], 0.0)
        f[VELOCITY, BIAS] = -step_s * body
        self.x[POSITION], self.x[VELOCITY] = position, velocity
        p = self.p
        p[:OWN] = f @ p[:OWN]
        p[:, :OWN] = p[:, :OWN] @ f.T
        p[:OWN, :OWN] += step_s * _BY_TIME + step_s**2 * _BY_TIME_2 + step_s**3 * _BY_TIME_3
        reported, gyro = (TURN_SETTLING_RAD if settling else TURN_RAD) ** 2, GYRO_RAD**2
        p[TURN, TURN] += step_s * reported * gyro / (reported + gyro)
        self.x[TURN] = self.turned_rad(motion, settling=settling)
        self.time_us += round(step_s * 1e6)

    def displace(self, time_us: int, by_m: Vec3, std_m: float, velocity_std_m_s: float) -> None:
        """Be elsewhere at a later time, with a velocity that is not known.

        Args:
            time_us: from now on.
            by_m: the way there, arena axes.
            std_m: of each coordinate of that way.
            velocity_std_m_s: of each coordinate of the velocity, in addition.
        """
        self.time_us = time_us
        self.x[POSITION] += by_m
        each = np.arange(3)
        self.p[each, each] += std_m**2
        self.p[each + 4, each + 4] += velocity_std_m_s**2

    def doubt(self, std_m: Vec3, heading_std_rad: float) -> None:
        """Know less well where drone and gates are in the arena; relative to one another they stay known.

        Args:
            std_m: of x, y and z, in addition.
            heading_std_rad: of the heading, in addition.
        """
        common = np.zeros((len(self.x), 4))
        common[:4] = np.eye(4)
        for at in self.gates.values():
            x, y, _ = self.x[at : at + 3] - self.x[POSITION]
            common[at : at + GATE] = np.eye(GATE)
            common[at : at + 2, TURN] = (-y, x)
        self.p += common * np.square((*std_m, heading_std_rad)) @ common.T

    def distance2(self, model: Model) -> float | None:
        """Square of a measurement's Mahalanobis distance; None if it cannot be made."""
        at = model(self.x)
        if at is None:
            return None
        spread = at.jacobian @ self.p @ at.jacobian.T + at.noise
        return float(at.residual @ np.linalg.solve(spread, at.residual))

    def update(self, model: Model, most2: float = inf) -> bool:
        """Use a measurement, linearised where it leads to (Bell & Cathey, IEEE TAC 38(2), 1993).

        Args:
            model: of the measurement.
            most2: it is used if the squares of the Mahalanobis distances of what is measured and of the state
                from where it leads to are no more together. For a linear model this is `distance2`; it also
                holds where little was known, and the model is far from linear.

        Returns:
            Whether it was used.
        """
        before = at = self.x
        for _ in range(ITERATIONS):
            measurement = model(at)
            if measurement is None:
                break
            h, noise = measurement.jacobian, measurement.noise
            across = self.p @ h.T
            innovation = measurement.residual - h @ (before - at)
            gain = np.linalg.solve(h @ across + noise, across.T).T
            led = before + gain @ innovation
            moved, at = float(np.abs(led - at).max()), led
            if moved < MOVED:
                break
        if at is before:
            return False
        if most2 < inf:
            reached, of_state = model(at), np.linalg.solve(h @ across + noise, innovation)
            if reached is None:
                return False
            distance2 = float(of_state @ h @ across @ of_state)
            distance2 += float(reached.residual @ np.linalg.solve(reached.noise, reached.residual))
            if distance2 > most2:
                return False
        kept = np.eye(len(before)) - gain @ h
        self.x, self.p = at, kept @ self.p @ kept.T + gain @ noise @ gain.T
        return True

    def add_gate(self, colour: str, state: Floats, covariance: Floats) -> None:
        """Begin to estimate a gate: x, y, z and yaw as seen from the drone where it is estimated to be.

        Args:
            colour: of the gate, which is not in the state yet.
            state: in the arena.
            covariance: of the errors of seeing it, those of the drone's place not included, shape (4, 4).
        """
        n = len(self.x)
        j = np.zeros((GATE, n))
        j[:3, POSITION] = np.eye(3)
        x, y, _ = state[:3] - self.x[POSITION]
        j[:, TURN] = (-y, x, 0.0, 1.0)
        across = j @ self.p
        self.p = np.block([[self.p, across.T], [across, across @ j.T + covariance]])
        self.x = np.concatenate((self.x, state))
        self.gates[colour] = n

    def drop_gate(self, colour: str) -> None:
        """Forget a gate."""
        at = self.gates.pop(colour)
        kept = np.r_[0:at, at + GATE : len(self.x)]
        self.x, self.p = self.x[kept], self.p[np.ix_(kept, kept)]
        self.gates = {other: n if n < at else n - GATE for other, n in self.gates.items()}

    def gate(self, colour: str) -> Floats | None:
        """x, y, z and yaw of a gate; None if it is not estimated."""
        at = self.gates.get(colour)
        return None if at is None else self.x[at : at + GATE]

    def gate_from_drone(self, colour: str) -> Floats:
        """Covariance of a gate's place and yaw relative to the drone, in the arena's axes, shape (4, 4)."""
        first = self.gates[colour]
        gate = slice(first, first + GATE)
        px, py = self.x[:2].tolist()
        x, y = self.x[first : first + 2].tolist()
        by_drone = np.array(
            ((1.0, 0.0, 0.0, py - y), (0.0, 1.0, 0.0, x - px), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
        )
        relative = self.p[gate] - by_drone @ self.p[:GATE]  # its position and turn come first
        covariance: Floats = relative[:, gate] - relative[:, :GATE] @ by_drone.T
        return covariance
