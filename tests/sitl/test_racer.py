"""The racer with 3-inch propellers: its figures, and its flights in still and moving air."""

from math import hypot, pi, sqrt

import numpy as np
import pytest

from firmware_py.commands import VelocityFrdCommand
from firmware_py.status import FlightMode
from framerunner.vehicle.airframe import load_airframe
from scenarios.air import Wind
from scenarios.models import Gate, Scenario
from tests.firmware_py.flying import Flight
from tests.flight import Hover

RACER = load_airframe("racer-3in")
RHO_KG_M3, DIAMETER_M = 1.225, 0.0762


def windy(speed_m_s, turbulence_m_s=0.0):
    return Scenario(
        name="windy", wind=Wind(speed_m_s=speed_m_s, direction_rad=0.7, turbulence_m_s=turbulence_m_s)
    )


def test_its_file_agrees_with_its_sources():
    per_turn = (2 * pi) ** 2
    assert pytest.approx(0.16 * RHO_KG_M3 * DIAMETER_M**4 / per_turn, rel=1e-3) == RACER.motor.thrust_n_s2
    torque = 0.102 * RHO_KG_M3 * DIAMETER_M**5 / (2 * pi) / per_turn
    assert torque == pytest.approx(RACER.motor.torque_nm_s2, rel=1e-3)
    assert sqrt(2 / pi) * 0.16**1.5 / 0.102 == pytest.approx(0.5, abs=0.005)
    assert RACER.full_thrust_n / RACER.weight_n > 4.0
    assert RACER.parameters["MPC_THR_HOVER"] == pytest.approx(RACER.weight_n / RACER.full_thrust_n, abs=1e-3)
    assert 2 * RACER.motor.radius_m == DIAMETER_M


def test_it_fits_through_a_gate_also_when_tilted():
    width_m, height_m = Gate(colour="red", x_m=0, y_m=0, z_m=1).opening_m
    assert RACER.envelope_m[1] < width_m - 0.1
    assert RACER.envelope_m[2] + RACER.envelope_m[0] * np.sin(0.35) < height_m  # 20 degrees


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_steps_of_velocity_do_not_overshoot(axis, sign):
    hover = Hover(RACER)
    hover.fly(1.0, VelocityFrdCommand())
    wanted = [0.0, 0.0, 0.0]
    wanted[axis] = sign
    samples = hover.fly(3.0, VelocityFrdCommand(tuple(wanted)))
    reached = [sign * getattr(s, ("forward_m_s", "right_m_s", "down_m_s")[axis]) for s in samples]
    assert next(i for i, v in enumerate(reached) if v > 0.9) < 0.5 / 0.004
    assert max(reached) < 1.02
    assert reached[-1] == pytest.approx(1.0, abs=0.002)


@pytest.mark.parametrize("airframe", ["racer-3in", "x500"])
@pytest.mark.parametrize("velocity", [(0.0, 0.0, 0.0), (1.0, -0.5, 0.0)])
def test_steady_wind_leaves_no_error_of_velocity(airframe, velocity):
    hover = Hover(load_airframe(airframe))
    hover.dynamics.set_air_velocity((4.0, -3.0, 0.0))
    hover.fly(6.0, VelocityFrdCommand(velocity))
    last = hover.fly(0.5, VelocityFrdCommand(velocity))[-1]
    assert (last.forward_m_s, last.right_m_s, last.down_m_s) == pytest.approx(velocity, abs=0.003)
    assert last.tilt_rad > 0.02


def test_takes_off_holds_and_lands_where_it_started():
    flight = Flight("racer-3in").climb_to(1.5)
    assert flight.now.height_m == pytest.approx(1.5, abs=0.05)
    assert flight.now.distance_m() < 0.02
    flight.autopilot.land()
    flight.take(10.0, lambda: not flight.armed)
    assert flight.landed
    assert flight.now.distance_m() < 0.03


def test_the_whole_flight_in_strong_wind():
    flight = Flight("racer-3in", scenario=windy(5.0, 1.0), seed=3).climb_to(1.5)
    held = flight.run(20.0)
    assert {sample.mode for sample in held} == {FlightMode.HOLD}
    place = np.array([sample.position_ned_m for sample in held])
    speed = np.array([sample.velocity_ned_m_s for sample in held])
    away_m = place - place.mean(axis=0)
    assert np.sqrt(np.mean(np.sum(away_m**2, axis=1))) < 0.08
    assert np.max(np.abs(away_m)) < 0.2
    assert np.max(np.abs(speed.mean(axis=0))) < 0.01
    flight.autopilot.land()
    flight.take(10.0, lambda: not flight.armed)
    assert hypot(*flight.now.position_ned_m[:2]) < 0.5


def test_the_papers_drone_cannot_hold_in_such_wind():
    """Its drag at 2 m/s needs more tilt than the autopilot allows; it is blown away but does not fall."""
    flight = Flight("abejorro", scenario=windy(2.5), seed=3).climb_to(1.5)
    start = flight.now
    end = flight.run(10.0)[-1]
    assert end.distance_m(*start.position_ned_m[:2]) > 2.0
    assert end.tilt_deg == pytest.approx(29.8, abs=1.0)
    assert end.height_m == pytest.approx(1.5, abs=0.3)
