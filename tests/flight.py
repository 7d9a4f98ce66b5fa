"""Helpers of tests that fly the stabiliser in JSBSim, without commander and MAVLink."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import asin, atan2, cos, hypot, sin

from firmware_py.commands import ControlCommand
from firmware_py.control.stabiliser import Stabiliser
from firmware_py.types import MotorOutput, VehicleState
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.airframe import Airframe, load_airframe
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
    state: VehicleState
    output: MotorOutput


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


Told = ControlCommand | Callable[[VehicleState], ControlCommand]
"""A command, or what makes one of the state."""


class Hover:
    """A body in the air with its stabiliser, flown piece by piece.

    Attributes:
        airframe: what flies.
        dynamics: the body.
        stabiliser: told what to do by `fly`.
        samples: one a control period, since the start.
    """

    def __init__(self, airframe: Airframe, yaw_rad: float = 0.3, height_m: float = 20.0) -> None:
        self.airframe = airframe
        self.dynamics = Dynamics(airframe, (0.0, 0.0, -height_m), yaw_rad, rate_hz=500, **ORIGIN)
        self.stabiliser = Stabiliser(airframe, PERIOD_S)
        self.samples: list[Sample] = []

    def fly(self, seconds: float, told: Told) -> list[Sample]:
        """Go on for a time; returns the samples of it."""
        start = len(self.samples)
        for _ in range(round(seconds / PERIOD_S)):
            step = len(self.samples)
            state = state_of(self.dynamics, step * 4000)
            command = told(state) if callable(told) else told
            output = self.stabiliser.step(state, command)
            self.dynamics.command_motors(output.speeds_rad_s)
            self.dynamics.run()
            self.dynamics.run()
            north, east, down = state.velocity_ned_m_s
            c, s = cos(state.yaw_rad), sin(state.yaw_rad)
            self.samples.append(
                Sample(
                    step * PERIOD_S,
                    c * north + s * east,
                    c * east - s * north,
                    down,
                    state.angular_rate_frd_rad_s[2],
                    hypot(state.roll_rad, state.pitch_rad),
                    state.position_ned_m,
                    state,
                    output,
                )
            )
        return self.samples[start:]


def fly(
    commands: Sequence[tuple[float, Told]], *, airframe: Airframe | None = None, yaw_rad: float = 0.3
) -> list[Sample]:
    """Fly (seconds, command) pairs one after another from hover at 20 m; one sample a control period."""
    hover = Hover(airframe or load_airframe("abejorro"), yaw_rad)
    for seconds, told in commands:
        hover.fly(seconds, told)
    return hover.samples
