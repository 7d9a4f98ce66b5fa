from math import isnan

import pytest

from firmware_py.types import Sensors
from sitl.failures import Failures

GPS, BATTERY, MOTOR = 4, 100, 101
OK, OFF, STUCK, GARBAGE = 0, 1, 2, 3


class Motors:
    """Remembers what became of each."""

    def __init__(self):
        self.states = ["whole"] * 4

    def fail_motor(self, index, *, stuck=False):
        self.states[index] = "stuck" if stuck else "off"

    def repair_motor(self, index):
        self.states[index] = "whole"


@pytest.fixture
def motors():
    return Motors()


@pytest.fixture
def failures(motors):
    return Failures(motors, 4)


def sample():
    return Sensors(1000, (1.0, 2.0, 3.0), (0.1, 0.2, 0.3), (1.0, 0.0, 0.0, 0.0), (0.0,) * 3, (0.0, 0.0, -9.8))


def test_a_motor_stops_sticks_and_is_mended(failures, motors):
    assert failures.inject(MOTOR, OFF, 2)
    assert failures.inject(MOTOR, STUCK, 4)
    assert motors.states == ["whole", "off", "whole", "stuck"]
    assert failures.inject(MOTOR, OK, 0)
    assert motors.states == ["whole"] * 4
    assert failures.falsify is None


@pytest.mark.parametrize(
    "what",
    [(MOTOR, OFF, 5), (MOTOR, GARBAGE, 1), (GPS, STUCK, 0), (BATTERY, OFF, 2), (0, OFF, 0), (999, OK, 0)],
)
def test_what_cannot_be_broken_stays_whole(failures, motors, what):
    assert not failures.inject(*what)
    assert motors.states == ["whole"] * 4
    assert failures.falsify is None


def test_without_gps_there_is_no_position_until_it_is_mended(failures):
    truth = sample()
    assert failures.inject(GPS, OFF, 0)
    said = failures.falsify(truth)
    assert all(map(isnan, said.position_ned_m[:2] + said.velocity_ned_m_s[:2]))
    assert said.position_ned_m[2] == truth.position_ned_m[2]  # the barometer's
    assert said.attitude == truth.attitude
    assert truth.position_ned_m == (1.0, 2.0, 3.0)  # the world's own sample is left alone
    assert failures.inject(GPS, OK, 0)
    assert failures.falsify is None


def test_an_empty_battery_has_no_voltage(failures):
    assert failures.inject(BATTERY, OFF, 1)
    assert failures.inject(GPS, OFF, 1)
    assert failures.inject(GPS, OK, 1)
    said = failures.falsify(sample())
    assert said.battery_voltage_v == 0.0
    assert said.position_ned_m == (1.0, 2.0, 3.0)
