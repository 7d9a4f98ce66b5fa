"""How well a drone on honest sensors holds its place, and follows a velocity in wind.

python -m benchmarks.hover [--seeds 5] [--seconds 60]
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from math import cos, nan, sin

import numpy as np
import numpy.typing as npt

from firmware_py.setpoints import BodyVelocitySetpoint, Setpoint, TrajectorySetpoint
from firmware_py.status import FlightMode
from firmware_py.types import VehicleState
from framerunner.geometry.axes import flip_vector
from framerunner.geometry.rotations import yaw_of
from framerunner.geometry.vectors import Vec3
from scenarios.air import Wind
from scenarios.loader import load_scenario
from sitl.simulation import Simulation

PLACE_NED_M = (0.5, 0.3, -1.5)
SPEED_M_S = 1.0  # forward
SETTLING_S = 6.0
STREAM_US = 48_000  # set-points at 20 Hz
SAMPLE_US = 20_000
Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Held:
    """How a place was held.

    Attributes:
        max_m: largest distance in space from the set place.
        absolute_m: root mean square of the horizontal distance from the set place on Earth.
        relative_m: the same from the mean place: without what the slow error of GPS has moved the set place.
    """

    max_m: float
    absolute_m: float
    relative_m: float


def hold_place(suite: str, airframe: str, seed: int, seconds: float) -> Held:
    """Hold a place of the local frame, and compare the true place with it.

    With GPS, where the local frame is on Earth is known as well as GPS knows it.
    """
    simulation = _start(suite, airframe, seed, None)
    _fly(simulation, SETTLING_S, _to_place)
    places = [place for place, _, _ in _fly(simulation, seconds, _to_place)]
    origin_arena_m = simulation.local_origin_arena_m
    assert origin_arena_m is not None
    away = np.array(places) - flip_vector(origin_arena_m) - PLACE_NED_M
    level = away[:, :2]
    return Held(float(np.max(np.linalg.norm(away, axis=1))), _rms(level), _rms(level - level.mean(axis=0)))


def follow_velocity(suite: str, airframe: str, seed: int, seconds: float, wind_m_s: float) -> float:
    """Fly a constant velocity in turbulent wind; the size of the mean true error of the velocity, m/s."""
    wind = Wind(speed_m_s=wind_m_s, direction_rad=0.7, turbulence_m_s=wind_m_s / 5)
    simulation = _start(suite, airframe, seed, wind)
    _fly(simulation, SETTLING_S, _forward)
    flown = _fly(simulation, seconds, _forward)
    errors = [
        (cos(yaw) * north + sin(yaw) * east - SPEED_M_S, cos(yaw) * east - sin(yaw) * north, down)
        for _, (north, east, down), yaw in flown
    ]
    return float(np.linalg.norm(np.mean(errors, axis=0)))


def _start(suite: str, airframe: str, seed: int, wind: Wind | None) -> Simulation:
    """A simulation with its drone hovering in the air."""
    field = load_scenario("open-field")
    chosen = field.model_copy(update={"sensors": suite, "airframe": airframe, "wind": wind or Wind()})
    simulation = Simulation(chosen, seed=seed)
    autopilot = simulation.autopilot
    while not autopilot.status.ready:
        simulation.tick()
    autopilot.takeoff()
    autopilot.arm()
    for _ in range(1500):
        simulation.tick()
    return simulation


def _fly(
    simulation: Simulation, seconds: float, setpoint: Callable[[VehicleState], Setpoint]
) -> list[tuple[Vec3, Vec3, float]]:
    """Fly set-points; true places and velocities, NED, and true headings."""
    autopilot, dynamics = simulation.autopilot, simulation.world.dynamics
    found, end_us = [], simulation.time_us + round(seconds * 1e6)
    while simulation.time_us < end_us:
        if simulation.time_us % STREAM_US == 0:
            autopilot.accept_setpoint(setpoint(autopilot.state))
            if autopilot.status.mode is not FlightMode.OFFBOARD:
                autopilot.set_mode(FlightMode.OFFBOARD)
        simulation.tick()
        if simulation.time_us % SAMPLE_US == 0:
            heading = yaw_of(dynamics.attitude())
            found.append((dynamics.position_ned_m(), dynamics.velocity_ned_m_s(), heading))
    return found


def _to_place(state: VehicleState) -> Setpoint:
    return TrajectorySetpoint(state.time_us, position_ned_m=PLACE_NED_M, yaw_rad=0.0)


def _forward(state: VehicleState) -> Setpoint:
    ned = (SPEED_M_S * cos(state.yaw_rad), SPEED_M_S * sin(state.yaw_rad), 0.0)
    return BodyVelocitySetpoint(state.time_us, (SPEED_M_S, 0.0, 0.0), nan, 0.0, ned)


def _rms(distances: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(distances**2, axis=1))))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=60.0)
    options = parser.parse_args()
    seeds = range(options.seeds)
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for suite, airframe in (("mocap", "abejorro"), ("mocap", "racer-3in"), ("outdoor", "x500")):
            held = list(pool.map(partial(hold_place, suite, airframe, seconds=options.seconds), seeds))
            absolute, relative = (
                [getattr(each, name) for each in held] for name in ("absolute_m", "relative_m")
            )
            print(
                f"{suite}, {airframe}: at most {max(each.max_m for each in held):.3f} m from the set place; "
                f"horizontal RMS: absolute {np.sqrt(np.mean(np.square(absolute))):.3f} m over all flights, "
                f"relative {min(relative):.3f} to {max(relative):.3f} m"
            )
        for suite, airframe in (("mocap", "racer-3in"), ("outdoor", "x500"), ("ideal", "x500")):
            follow = partial(follow_velocity, suite, airframe, seconds=20.0, wind_m_s=5.0)
            errors = list(pool.map(follow, seeds))
            print(
                f"{suite}, {airframe}, wind 5 m/s: mean error of the velocity {max(errors):.3f} m/s at most"
            )
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
