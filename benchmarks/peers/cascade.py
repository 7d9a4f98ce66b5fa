"""A cascaded position controller in plain Python, for simulators that come without one.

Proportional loops for position, velocity, attitude and body rates: a small part of what our autopilot
computes in a tick. Axes of world and body: x forward, y left, z up.
"""

from __future__ import annotations

from math import asin, atan2, cos, pi, sin

GRAVITY_M_S2 = 9.81
POSITION_GAIN = 1.0  # 1/s; each inner loop is about three times as fast as the one around it
VELOCITY_GAIN = 2.5
ATTITUDE_GAIN = 7.0
RATE_GAIN = 20.0
SPEED_LIMIT_M_S = 1.0  # as the frame challenge has it
ACCELERATION_LIMIT_M_S2 = 4.0
YAW_RATE_LIMIT_RAD_S = 1.0


class Cascade:
    """From state and goal to the thrusts of four rotors: front right, rear left, front left, rear right.

    Args:
        mass_kg: of the drone.
        inertia_kg_m2: about its x, y, z.
        arm_m: of the rotors along x and along y.
        torque_per_thrust_m: a rotor's drag torque by its thrust; the first two push the nose left.
        max_thrust_n: of one rotor.
    """

    def __init__(
        self,
        mass_kg: float,
        inertia_kg_m2: tuple[float, float, float],
        arm_m: float,
        torque_per_thrust_m: float,
        max_thrust_n: float,
    ) -> None:
        self._mass_kg = mass_kg
        self._roll, self._pitch, self._yaw = (RATE_GAIN * each for each in inertia_kg_m2)
        self._arm_m = 4 * arm_m
        self._torque_m = 4 * torque_per_thrust_m
        self._max_thrust_n = max_thrust_n

    def step(
        self, position: list[float], velocity: list[float], goal: tuple[float, float, float], goal_yaw: float
    ) -> tuple[float, float, float, float]:
        """The rotors' thrusts, N.

        Args:
            position: x, y, z (metres) and the attitude's quaternion w, x, y, z.
            velocity: in world axes (m/s), then the body rates (rad/s).
            goal: x, y, z, metres.
            goal_yaw: radians.
        """
        x, y, z, qw, qx, qy, qz = position
        vx, vy, vz, p, q, r = velocity
        roll = atan2(2 * (qw * qx + qy * qz), 1 - 2 * (qx * qx + qy * qy))
        pitch = asin(clamp(2 * (qw * qy - qz * qx), 1.0))
        yaw = atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
        ax = pull(goal[0] - x, vx)
        ay = pull(goal[1] - y, vy)
        az = pull(goal[2] - z, vz)
        c, s = cos(yaw), sin(yaw)
        wanted_pitch = atan2(c * ax + s * ay, GRAVITY_M_S2)
        wanted_roll = atan2(s * ax - c * ay, GRAVITY_M_S2)
        turn = (goal_yaw - yaw + pi) % (2 * pi) - pi
        moment_x = self._roll * (ATTITUDE_GAIN * (wanted_roll - roll) - p)
        moment_y = self._pitch * (ATTITUDE_GAIN * (wanted_pitch - pitch) - q)
        moment_z = self._yaw * (clamp(2.0 * turn, YAW_RATE_LIMIT_RAD_S) - r)
        return self._mix(
            self._mass_kg * (GRAVITY_M_S2 + az) / (cos(roll) * cos(pitch)), moment_x, moment_y, moment_z
        )

    def _mix(
        self, thrust_n: float, moment_x: float, moment_y: float, moment_z: float
    ) -> tuple[float, float, float, float]:
        each, top = thrust_n / 4, self._max_thrust_n
        mx, my, mz = moment_x / self._arm_m, moment_y / self._arm_m, moment_z / self._torque_m
        return (
            min(max(each - mx - my + mz, 0.0), top),
            min(max(each + mx + my + mz, 0.0), top),
            min(max(each + mx - my - mz, 0.0), top),
            min(max(each - mx + my - mz, 0.0), top),
        )


def pull(distance_m: float, speed_m_s: float) -> float:
    """Acceleration towards a goal along one axis, m/s²."""
    wanted_m_s = clamp(POSITION_GAIN * distance_m, SPEED_LIMIT_M_S)
    return clamp(VELOCITY_GAIN * (wanted_m_s - speed_m_s), ACCELERATION_LIMIT_M_S2)


def clamp(value: float, limit: float) -> float:
    """The value limited to -limit..limit."""
    return min(max(value, -limit), limit)
