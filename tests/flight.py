"""Helpers of tests that fly the stabiliser in JSBSim, without commander and MAVLink."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import asin, atan2, cos, hypot, sin

from firmware_py.airframe import Airframe, load_airframe
from firmware_py.control.stabiliser import Stabiliser
from firmware_py.types import RateCommand, Vec3, VehicleState
from sitl.dynamics import Dynamics

PERIOD_S = 0.004
ORIGIN = {"latitude_deg": 47.397742, "longitude_deg": 8.545594, "altitude_m": 489.0}


@dataclass(frozen=True)
class Sample:
    time_s: float
    forward_m_s: float
    right_m_s: float
    down_m_s: float
    yaw_rate_rad_s: float
    tilt_rad: float
    position_ned_m: Vec3


def state_of(dynamics: Dynamics, time_us: int) -> VehicleState:
    w, x, y, z = dynamics.attitude()
    return VehicleState(
        time_us,
        dynamics.position_ned_m(),
        dynamics.velocity_ned_m_s(),
        (w, x, y, z),
        atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        asin(max(-1.0, min(1.0, 2 * (w * y - z * x)))),
        atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
        dynamics.angular_rate_frd_rad_s(),
        dynamics.motion()[3],
    )


def fly(
    commands: Sequence[tuple[float, RateCommand]], *, airframe: Airframe | None = None, yaw_rad: float = 0.3
) -> list[Sample]:
    """Fly (seconds, command) pairs one after another from hover at 20 m; one sample a control period."""
    airframe = airframe or load_airframe("abejorro")
    dynamics = Dynamics(airframe, (0.0, 0.0, -20.0), yaw_rad, rate_hz=500, **ORIGIN)
    stabiliser = Stabiliser(airframe, PERIOD_S)
    samples, step = [], 0
    for seconds, command in commands:
        for _ in range(round(seconds / PERIOD_S)):
            state = state_of(dynamics, step * 4000)
            dynamics.command_motors(stabiliser.step(state, command).speeds_rad_s)
            dynamics.run()
            dynamics.run()
            north, east, down = state.velocity_ned_m_s
            c, s = cos(state.yaw_rad), sin(state.yaw_rad)
            samples.append(
                Sample(
                    step * PERIOD_S,
                    c * north + s * east,
                    c * east - s * north,
                    down,
                    state.angular_rate_frd_rad_s[2],
                    hypot(state.roll_rad, state.pitch_rad),
                    state.position_ned_m,
                )
            )
            step += 1
    return samples
