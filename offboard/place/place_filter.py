"""The filter of the drone's place: an extended Kalman filter over the drone and the gates that it has seen.

The state is the drone's position and velocity in the arena, the angle by which its reported heading is wrong,
the accelerometer's bias, and for each gate x, y, z, yaw, size and from where it was seen first: simultaneous
localisation and mapping (Durrant-Whyte & Bailey, IEEE Robotics & Automation Magazine 13(2), 2006). Roll and
pitch are taken as reported: the vehicle's own filter knows them by gravity to a fraction of a degree, and
what is left acts like a bias.
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
POSE = 4  # numbers of a place: x, y, z and heading; those of the drone come first
# Of a gate: the logarithm of its size over that of its shape, from where it was seen first, numbers in all.
SIZE, SEEN_FROM, GATE = 4, slice(5, 8), 8

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
        x: the state, shape (10 + 8 gates + 4 clones,).
        p: its covariance.
        gates: the first index of each gate, by colour. Its place is where one of the size of its shape would
            be, as seen from where it was seen first: that place is known, whatever its size. Where that was
            is known as well as the drone's place then, so it is part of the state.
        clones: the first index of where the drone was, by some times.
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
        self.clones: dict[int, int] = {}

    @property
    def turn_rad(self) -> float:
        """What must be added to the reported heading."""
        return float(self.x[TURN])

    def covariance(self, time_us: int) -> Floats:
        """Of x, y, z and the turn at a time soon after the state's, shape (4, 4)."""
        moved = np.eye(4, OWN)
        moved[POSITION, VELOCITY] = (time_us - self.time_us) * 1e-6 * np.eye(3)
        covariance: Floats = moved @ self.p[:OWN, :OWN] @ moved.T
        return covariance

    def turned_rad(self, motion: InertialMotion, reported_std_rad: float) -> float:
        """The turn after a motion: that of the reported heading and of the gyroscope, by their noise."""
        return self.turn_rad + motion.turn_rad / (1.0 + (GYRO_RAD / reported_std_rad) ** 2)

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

    def predict(self, motion: InertialMotion, reported_std_rad: float = TURN_RAD) -> None:
        """Let the time of a motion pass.

        Covariance of a double integrator driven by white noise: Bar-Shalom, Li & Kirubarajan, "Estimation
        with Applications to Tracking and Navigation", 2001, 6.2.2.

        Args:
            motion: since the state.
            reported_std_rad: of the reported heading, after a second; infinite: it is not used.
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
        p[TURN, TURN] += step_s * GYRO_RAD**2 / (1.0 + (GYRO_RAD / reported_std_rad) ** 2)
        self.x[TURN] = self.turned_rad(motion, reported_std_rad)
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
        for at in (*self.gates.values(), *self.clones.values()):
            x, y, _ = self.x[at : at + 3] - self.x[POSITION]
            common[at : at + POSE] = np.eye(POSE)
            common[at : at + 2, TURN] = (-y, x)
        for at in (first + SEEN_FROM.start for first in self.gates.values()):
            x, y, _ = self.x[at : at + 3] - self.x[POSITION]
            common[at : at + 3, POSITION] = np.eye(3)
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

    def add_gate(self, colour: str, state: Floats, covariance: Floats, size_std: float) -> None:
        """Begin to estimate a gate: x, y, z and yaw as seen from the drone where it is estimated to be.

        Args:
            colour: of the gate, which is not in the state yet.
            state: in the arena, if it has the size of its shape.
            covariance: of the errors of seeing it, those of the drone's place not included, shape (4, 4).
            size_std: standard deviation of the logarithm of its size.
        """
        n = len(self.x)
        noise = np.zeros((GATE, GATE))
        noise[:POSE, :POSE], noise[SIZE, SIZE] = covariance, size_std**2
        x, y, _ = state[:3] - self.x[POSITION]
        j = np.zeros((GATE, n))
        j[:3, POSITION] = np.eye(3)
        j[:POSE, TURN] = (-y, x, 0.0, 1.0)
        j[SEEN_FROM, POSITION] = np.eye(3)
        across = j @ self.p
        self.p = np.block([[self.p, across.T], [across, across @ j.T + noise]])
        self.x = np.concatenate((self.x, state, (0.0,), self.x[POSITION]))
        self.gates[colour] = n

    def drop_gate(self, colour: str) -> None:
        """Forget a gate."""
        self._cut(self.gates.pop(colour), GATE)

    def add_clone(self, time_us: int) -> None:
        """Keep where the drone is now, as it is at a time."""
        now = np.r_[0:POSE]
        self.clones[time_us] = len(self.x)
        self.x = np.concatenate((self.x, self.x[now]))
        self.p = np.block([[self.p, self.p[:, now]], [self.p[now], self.p[np.ix_(now, now)]]])

    def drop_clone(self, time_us: int) -> None:
        """Forget where the drone was at a time."""
        self._cut(self.clones.pop(time_us), POSE)

    def _cut(self, at: int, count: int) -> None:
        kept = np.r_[0:at, at + count : len(self.x)]
        self.x, self.p = self.x[kept], self.p[np.ix_(kept, kept)]
        self.gates = {other: n if n < at else n - count for other, n in self.gates.items()}
        self.clones = {other: n if n < at else n - count for other, n in self.clones.items()}

    def inform(self, index: npt.NDArray[np.intp], information: Floats, vector: Floats) -> None:
        """Use measurements by what they say of a part of the state (information filter).

        Args:
            index: of that part, shape (k,).
            information: Jacobian's transpose times inverse noise times Jacobian, shape (k, k).
            vector: likewise times the residual, shape (k,).
        """
        across = self.p[:, index]
        inner = np.eye(len(index)) + information @ across[index]
        gain = np.linalg.solve(inner.T, across.T).T  # covariance of all with that part, afterwards
        self.x = self.x + gain @ vector
        p = self.p - gain @ information @ across.T
        self.p = 0.5 * (p + p.T)

    def gate(self, colour: str) -> Floats | None:
        """x, y, z and yaw of a gate; None if it is not estimated."""
        at = self.gates.get(colour)
        return None if at is None else self.x[at : at + POSE]

    def size(self, colour: str) -> tuple[float, float]:
        """The logarithm of a gate's size, and its standard deviation."""
        at = self.gates[colour] + SIZE
        return float(self.x[at]), sqrt(self.p[at, at])

    def if_sized(self, colour: str) -> Floats:
        """x, y, z and yaw of a gate if it has the size of its shape."""
        first = self.gates[colour]
        at = first + SIZE
        by_size: Floats = self.p[first : first + POSE, at] / self.p[at, at]
        sized: Floats = self.x[first : first + POSE] - self.x[at] * by_size
        return sized

    def gate_from_drone(self, colour: str) -> Floats:
        """Covariance of a gate's place and yaw relative to the drone, in the arena's axes, shape (4, 4)."""
        first = self.gates[colour]
        gate = slice(first, first + POSE)
        px, py = self.x[:2].tolist()
        x, y = self.x[first : first + 2].tolist()
        by_drone = np.array(
            ((1.0, 0.0, 0.0, py - y), (0.0, 1.0, 0.0, x - px), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
        )
        relative = self.p[gate] - by_drone @ self.p[:POSE]
        covariance: Floats = relative[:, gate] - relative[:, :POSE] @ by_drone.T
        return covariance
