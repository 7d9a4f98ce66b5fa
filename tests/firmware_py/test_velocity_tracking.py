"""The x500 follows the velocity set-points of a recorded PX4 flight at least as closely as PX4 did."""

from __future__ import annotations

import csv
from math import cos, nan, sin
from pathlib import Path

import numpy as np
import pytest

from firmware_py.setpoints import BodyVelocitySetpoint
from firmware_py.status import FlightMode
from scenarios.loader import load_scenario
from sitl.simulation import Simulation

RECORD = Path(__file__).parent / "recorded" / "px4_velocity_steps.csv"
SETPOINT_US = 48_000  # at 20 Hz, as recorded
AXES = ("forward", "right", "down", "yaw rate")


def recorded():
    """Times, set-points and velocities of PX4: shapes (n,), (n, 4), (n, 4)."""
    with RECORD.open() as file:
        rows = np.array([[float(value) for value in row] for row in list(csv.reader(file))[1:]])
    return rows[:, 0], rows[:, 1:5], rows[:, 5:9]


def replayed(suite, seed=1):
    """Velocities of our x500 at the recorded times, by its own estimate: shape (n, 4)."""
    times_s, wanted, _ = recorded()
    scenario = load_scenario("open-field").model_copy(update={"sensors": suite, "airframe": "x500"})
    simulation = Simulation(scenario, seed=seed)
    autopilot = simulation.autopilot
    while not autopilot.status.ready:
        simulation.tick()
    autopilot.takeoff()
    autopilot.arm()
    lift_off_us = simulation.time_us + 12_000_000
    while simulation.time_us < lift_off_us:
        simulation.tick()
    start_us, found = simulation.time_us, []
    for time_s, setpoint in zip(times_s, wanted, strict=True):
        while simulation.time_us < start_us + time_s * 1e6:
            if simulation.time_us % SETPOINT_US == 0:
                send(autopilot, setpoint)
            simulation.tick()
        north, east, down = autopilot.state.velocity_ned_m_s
        c, s = cos(autopilot.state.yaw_rad), sin(autopilot.state.yaw_rad)
        turn_rad_s = autopilot.state.angular_rate_frd_rad_s[2]
        found.append((c * north + s * east, c * east - s * north, down, turn_rad_s))
    assert autopilot.status.mode is FlightMode.OFFBOARD
    return np.array(found)


def send(autopilot, setpoint):
    forward, right, down, turn = map(float, setpoint)
    c, s = cos(autopilot.state.yaw_rad), sin(autopilot.state.yaw_rad)
    ned = (c * forward - s * right, s * forward + c * right, down)
    autopilot.accept_setpoint(
        BodyVelocitySetpoint(autopilot.state.time_us, (forward, right, down), nan, turn, ned)
    )
    if autopilot.status.mode is not FlightMode.OFFBOARD:
        autopilot.set_mode(FlightMode.OFFBOARD)


def rms(errors):
    return np.sqrt(np.mean(errors**2, axis=0))


@pytest.mark.parametrize("suite", ["ideal", "outdoor"])
def test_follows_recorded_set_points_at_least_as_closely_as_px4(suite):
    _, wanted, px4 = recorded()
    ours = replayed(suite)
    for axis, our_rms, px4_rms in zip(AXES, rms(ours - wanted), rms(px4 - wanted), strict=True):
        assert our_rms <= px4_rms, axis
