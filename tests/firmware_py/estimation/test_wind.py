"""The wind estimated in flight, from drag."""

from math import cos, dist, sin

import pytest

from firmware_py.mavlink.telemetry.sensing import wind_cov
from scenarios.air import Wind
from scenarios.loader import load_scenario
from sitl.simulation import Simulation


def flown(airframe, suite, wind, seconds):
    """A flight that hovers in a wind, after some seconds."""
    scenario = load_scenario("open-field").model_copy(
        update={"sensors": suite, "airframe": airframe, "wind": wind}
    )
    simulation = Simulation(scenario, seed=3)
    while not simulation.autopilot.status.ready:
        simulation.tick()
    assert simulation.autopilot.wind is None or simulation.autopilot.wind.estimate is None
    simulation.autopilot.takeoff()
    simulation.autopilot.arm()
    for _ in range(int(seconds * 250)):
        simulation.tick()
    return simulation.autopilot


@pytest.mark.parametrize(
    ("airframe", "suite", "limit_m_s"), [("racer-3in", "mocap", 0.4), ("x500", "outdoor", 1.2)]
)
@pytest.mark.parametrize("direction_rad", [0.7, 4.0])
def test_finds_the_wind_within_its_deviation(airframe, suite, limit_m_s, direction_rad):
    wind = Wind(speed_m_s=4.0, direction_rad=direction_rad)
    autopilot = flown(airframe, suite, wind, 15.0)
    found, told = autopilot.wind.estimate, wind_cov(autopilot)
    off_m_s = dist(found.velocity_ned_m_s, (4.0 * cos(direction_rad), -4.0 * sin(direction_rad)))
    assert off_m_s < limit_m_s
    assert off_m_s < 4.0 * found.sigma_m_s
    assert (told.wind_x, told.wind_y) == found.velocity_ned_m_s
    assert told.var_horiz == pytest.approx(found.sigma_m_s**2)
    assert found.airspeed_m_s == pytest.approx(4.0, abs=1.0)


def test_with_ideal_sensors_nothing_is_estimated():
    autopilot = flown("x500", "ideal", Wind(), 1.0)
    assert autopilot.wind is None
    assert wind_cov(autopilot) is None
