"""No number that is not finite reaches a motor, whatever a sensor delivers."""

from dataclasses import fields, replace
from math import inf, isfinite, nan

import pytest

from firmware_py.types import MotorOutput
from framerunner.vehicle.measurements import ExternalPose, Readings
from scenarios.loader import load_scenario
from sitl.simulation import Simulation

TICKS = 150
SLOTS = ("imu", "magnetometer", "barometer", "gps", "range_finder", "optical_flow", "pose", "battery")


def airborne(sensors, airframe):
    scenario = load_scenario("open-field").model_copy(update={"sensors": sensors, "airframe": airframe})
    simulation = Simulation(scenario, seed=1)
    while not simulation.autopilot.status.ready:
        simulation.tick()
    simulation.autopilot.arm()
    simulation.autopilot.takeoff()
    for _ in range(1500):  # an x500 leaves the ground after 4 s
        simulation.tick()
    return simulation


def broken_samples(sample, bad):
    """The sample with each of its numbers replaced, one at a time."""
    for each in fields(sample):
        value = getattr(sample, each.name)
        if isinstance(value, float):
            yield each.name, replace(sample, **{each.name: bad})
        elif isinstance(value, tuple):
            for at in range(len(value)):
                numbers = (*value[:at], bad, *value[at + 1 :])
                yield f"{each.name}[{at}]", replace(sample, **{each.name: numbers})


class Breaker:
    """In place of the faults of sensors: replaces one number of one kind of sample."""

    def __init__(self, slot, number, bad):
        self.slot, self.number, self.bad = slot, number, bad
        self.numbers = 0

    def change(self, readings, pose):
        if self.slot == "battery":
            self.numbers = 2
            name = ("battery_voltage_v", "battery_current_a")[self.number]
            return replace(readings, **{name: self.bad}), pose
        sample = pose if self.slot == "pose" else getattr(readings, self.slot)
        if sample is None:
            return readings, pose
        broken = [each for _, each in broken_samples(sample, self.bad)]
        self.numbers = len(broken)
        if self.slot == "pose":
            return readings, broken[self.number]
        return replace(readings, **{self.slot: broken[self.number]}), pose


@pytest.mark.parametrize("slot", SLOTS)
def test_no_number_of_any_sensor_reaches_a_motor(slot):
    """Each number is broken in each way for some tenths of a second, one after the other, in one flight."""
    sensors, airframe = ("mocap", "racer-3in") if slot == "pose" else ("outdoor", "x500")
    if slot == "optical_flow":
        sensors = "flow"
    simulation = airborne(sensors, airframe)
    number, count = 0, 1
    while number < count:
        for bad in (nan, inf, -inf):
            breaker = Breaker(slot, number, bad)
            simulation.faults.sensors = breaker
            for _ in range(TICKS if slot != "imu" else 20):
                simulation.tick()
                assert all(map(isfinite, simulation.autopilot.output.speeds_rad_s)), (number, bad)
                assert isfinite(sum(simulation.autopilot.state.position_ned_m))
            count = breaker.numbers or 1
            simulation.faults.sensors = None
            for _ in range(20):
                simulation.tick()
        number += 1
    assert number > 1 or slot in ("barometer", "range_finder")
    assert simulation.autopilot.flight.failsafes == ()
    assert simulation.autopilot.status.armed


def test_samples_have_only_numbers_that_are_broken_here():
    """A new field of another type would not be tested."""
    assert {each.name for each in fields(Readings)} == {
        "time_us",
        "battery_voltage_v",
        "battery_current_a",
        *SLOTS[:-2],
    }
    assert {type(each.type) for each in fields(ExternalPose)} == {str}


def test_an_output_that_is_not_finite_is_held_back_and_ends_in_termination(monkeypatch):
    simulation = airborne("ideal", "x500")
    autopilot = simulation.autopilot
    before = autopilot.output.speeds_rad_s
    monkeypatch.setattr(autopilot, "_actuate", lambda command, landed: MotorOutput((nan,) * 4, nan))
    for _ in range(74):
        simulation.tick()
        assert autopilot.output.speeds_rad_s == before
    for _ in range(80):
        simulation.tick()
    assert set(autopilot.output.speeds_rad_s) == {0.0}
    assert autopilot.flight.failsafes[-1][1] == "Sensors lost: flight terminated"
