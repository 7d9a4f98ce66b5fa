import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_py.battery import BatteryMonitor, BatterySettings, warning
from firmware_py.parameters import Parameters
from framerunner.vehicle.airframe import load_airframe

X500 = load_airframe("x500")


def settings(**parameters):
    return BatterySettings(X500, Parameters(parameters, defaults=X500.parameters))


def test_the_airframes_values_apply_where_parameters_give_none():
    own = settings()
    assert own.capacity_mah == X500.battery.capacity_mah
    assert own.resistance_ohm == X500.battery.resistance_ohm
    told = settings(BAT1_CAPACITY=3000.0, BAT1_R_INTERNAL=0.01, BAT1_N_CELLS=6)
    assert (told.capacity_mah, told.resistance_ohm, told.cells) == (3000.0, pytest.approx(0.06), 6)


@pytest.mark.parametrize(
    ("voltage_v", "remaining"), [(17.0, 1.0), (16.2, 1.0), (15.3, 0.5), (14.4, 0.0), (9.0, 0.0)]
)
def test_the_voltage_without_load_gives_the_charge(voltage_v, remaining):
    monitor = BatteryMonitor(X500, Parameters(defaults=X500.parameters))
    monitor.update(0, voltage_v, 0.0)
    assert monitor.state.remaining == pytest.approx(remaining)


def test_voltage_drop_under_load_is_not_lost_charge():
    monitor = BatteryMonitor(X500, Parameters(defaults=X500.parameters))
    monitor.update(0, 15.3 - 20.0 * X500.battery.resistance_ohm, 20.0)
    assert monitor.state.remaining == pytest.approx(0.5)


def test_the_current_is_integrated():
    monitor = BatteryMonitor(X500, Parameters(defaults=X500.parameters))
    for tenth in range(601):
        monitor.update(tenth * 100_000, 16.0, 12.0)
    assert monitor.state.used_mah == pytest.approx(200.0)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_less_charge_never_gives_a_milder_warning(one, other):
    low, high = sorted((one, other))
    assert warning(low, settings()) >= warning(high, settings())


@pytest.mark.parametrize(
    ("remaining", "level"), [(1.0, 1), (0.15, 1), (0.149, 2), (0.069, 3), (0.049, 4), (0.0, 4)]
)
def test_px4s_thresholds(remaining, level):
    assert warning(remaining, settings()) == level
