"""How consistent the estimator is: seeded flights on honest sensors, errors against their covariance.

    python -m benchmarks.estimation [SUITE] [--flights 200] [--seconds 30]

The normalised estimation error squared (NEES) of attitude, velocity and position is compared with the bounds
of the chi-squared distribution, single (each flight) and averaged over all flights at each instant
(Bar-Shalom, Li & Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001, section 5.4),
and so is the normalised innovation squared (NIS) of each kind of measurement.
"""

from __future__ import annotations

import argparse
import os
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from math import cos, dist, pi, sin

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

from firmware_py.estimation.aiding.aid import NEVER_US
from firmware_py.estimation.inertial_estimator import InertialEstimator
from firmware_py.setpoints import BodyVelocitySetpoint
from firmware_py.status import FlightMode
from framerunner.geometry.rotations import multiply
from framerunner.geometry.vectors import Quaternion, Vec3
from scenarios.loader import load_scenario
from sitl.simulation import Simulation

STATES = 9  # attitude, velocity and position
AIRFRAMES = {"mocap": "abejorro", "outdoor": "x500", "flow": "x500"}
_SAMPLE_US = 100_000
_BACK_US = 400_000  # longer than any delay
_SETTLING_S = 3.0


@dataclass(slots=True)
class Consistency:
    """One flight.

    Attributes:
        nees: at each instant, shape (n,).
        nis: of each kind of measurement, every one sampled, and the numbers that it measures.
        position_m: distance of the estimated place of the present from the true one, shape (n,).
        velocity_m_s: the same of the velocity.
    """

    nees: list[float] = field(default_factory=list)
    nis: dict[str, tuple[int, list[float]]] = field(default_factory=dict)
    position_m: list[float] = field(default_factory=list)
    velocity_m_s: list[float] = field(default_factory=list)


def fly(suite: str, seed: int, seconds: float, *, moving: bool = True) -> Consistency:
    """Fly smooth changes of velocity and heading, or hover, and compare the estimate with the truth."""
    field = load_scenario("open-field")
    flat = field.base.model_copy(update={"top_m": 0.0})
    chosen = field.model_copy(
        update={"sensors": suite, "airframe": AIRFRAMES.get(suite, "x500"), "base": flat}
    )
    simulation = Simulation(chosen, seed=seed)
    autopilot, estimator = simulation.autopilot, simulation.autopilot.estimator
    assert isinstance(estimator, InertialEstimator)
    while not autopilot.status.ready:
        simulation.tick()
    estimator.aiding.ground.walk = 0.0  # it is told that this ground is flat; see docs/estimation.md
    home_us, start = simulation.time_us, _true(simulation)[2]
    if suite == "mocap":
        start = (0.0, 0.0, 0.0)  # its frame is the arena's
    autopilot.takeoff()
    autopilot.arm()
    found, history = Consistency(), dict[int, tuple[Quaternion, Vec3, Vec3]]()
    numbers = np.random.default_rng(seed)
    phases = numbers.uniform(0.0, 2.0 * pi, 4)
    end_us = home_us + int((seconds + 6.0) * 1e6)
    while simulation.time_us < end_us:
        flown_s = (simulation.time_us - home_us) / 1e6 - 6.0
        if moving and flown_s > 0.0 and simulation.time_us % 48_000 == 0:
            _steer(simulation, flown_s, phases)
        simulation.tick()
        attitude, velocity, place = _true(simulation)
        history[simulation.time_us] = (attitude, velocity, _minus(place, start))
        history.pop(simulation.time_us - _BACK_US, None)
        if flown_s > _SETTLING_S - 6.0 and simulation.time_us % _SAMPLE_US == 0:
            _compare(estimator, history, found)
    return found


def _steer(simulation: Simulation, time_s: float, phases: npt.NDArray[np.float64]) -> None:
    autopilot = simulation.autopilot
    forward, right, down, turn = (
        sin(2 * pi * time_s / period + phase)
        for period, phase in zip((7.0, 9.0, 11.0, 13.0), phases, strict=True)
    )
    velocity, yaw = (0.9 * forward, 0.6 * right, 0.3 * down), autopilot.state.yaw_rad
    ned = (
        cos(yaw) * velocity[0] - sin(yaw) * velocity[1],
        sin(yaw) * velocity[0] + cos(yaw) * velocity[1],
        velocity[2],
    )
    nan = float("nan")
    autopilot.accept_setpoint(BodyVelocitySetpoint(autopilot.state.time_us, velocity, nan, 0.8 * turn, ned))
    if autopilot.status.mode is not FlightMode.OFFBOARD:
        autopilot.set_mode(FlightMode.OFFBOARD)


def _compare(
    estimator: InertialEstimator,
    history: dict[int, tuple[Quaternion, Vec3, Vec3]],
    found: Consistency,
) -> None:
    now = history.get(estimator.state.time_us)
    if now is not None:
        found.position_m.append(dist(now[2], estimator.state.position_ned_m))
        found.velocity_m_s.append(dist(now[1], estimator.state.velocity_ned_m_s))
    into = estimator.aiding.target.filter
    then = history.get(into.time_us)
    if then is None:
        return
    attitude, velocity, place = then
    error = np.array(
        (
            *_turn(attitude, into.state.attitude),
            *_minus(velocity, into.state.velocity_ned_m_s),
            *_minus(place, into.state.position_ned_m),
        )
    )
    covariance = into.covariance.p[:STATES, :STATES]
    found.nees.append(float(error @ np.linalg.solve(covariance, error)))
    for aids in estimator.aiding.aids.values():
        for aid in aids:
            if aid.fused_us != NEVER_US:
                found.nis.setdefault(aid.name, (aid.numbers, []))[1].append(aid.nis)


def _true(simulation: Simulation) -> tuple[Quaternion, Vec3, Vec3]:
    dynamics = simulation.world.dynamics
    return (dynamics.attitude(), dynamics.velocity_ned_m_s(), dynamics.position_ned_m())


def _minus(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def _turn(true: Quaternion, estimated: Quaternion) -> Vec3:
    """The small rotation about the axes of NED from the estimated to the true attitude, rad."""
    w, x, y, z = multiply(true, (estimated[0], -estimated[1], -estimated[2], -estimated[3]))
    scale = 2.0 if w > 0.0 else -2.0
    return (scale * x, scale * y, scale * z)


def summary(flights: list[Consistency]) -> list[str]:
    """Lines for people."""
    shortest = min(len(flight.nees) for flight in flights)
    nees = np.array([flight.nees[:shortest] for flight in flights])
    lines = [f"{len(flights)} flights, {shortest} instants each", f"NEES {_shares(nees, STATES)}"]
    for name, (numbers, _) in flights[0].nis.items():
        series = [flight.nis[name][1] for flight in flights if name in flight.nis]
        shortest = min(map(len, series))
        lines.append(f"NIS of {name} {_shares(np.array([values[-shortest:] for values in series]), numbers)}")
    places = np.concatenate([flight.position_m for flight in flights])
    speeds = np.concatenate([flight.velocity_m_s for flight in flights])
    lines.append(f"position {_rms(places):.3f} m RMS, velocity {_rms(speeds):.3f} m/s RMS")
    return lines


def _shares(values: npt.NDArray[np.float64], degrees: int) -> str:
    """How many squares lie in their 95 % bounds: single ones, and means over all flights; shape (n, m)."""
    low, high = chi2.ppf((0.025, 0.975), degrees)
    single = np.mean((values > low) & (values < high))
    flights, means = len(values), values.mean(axis=0)
    mean_low, mean_high = chi2.ppf((0.025, 0.975), degrees * flights) / flights
    together = np.mean((means > mean_low) & (means < mean_high))
    return (
        f"({degrees}): mean {values.mean():.2f}; single {single:.1%} in {low:.3g} to {high:.3g}; "
        f"means {together:.1%} in {mean_low:.2f} to {mean_high:.2f}"
    )


def _rms(values: npt.NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("suite", nargs="?", default="mocap")
    parser.add_argument("--flights", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--hover", action="store_true")
    options = parser.parse_args()
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        waiting = [
            pool.submit(fly, options.suite, seed, options.seconds, moving=not options.hover)
            for seed in range(options.flights)
        ]
        flights = []
        for number, flight in enumerate(waiting, start=1):
            flights.append(flight.result())
            print(f"\r{number} of {options.flights}", end="", file=sys.stderr, flush=True)
    print(file=sys.stderr)
    print("\n".join(summary(flights)))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
