import pytest

from firmware_py.parameters import Parameters
from framerunner.vehicle.airframe import load_airframe
from sitl.battery import Battery

X500 = load_airframe("x500")
HOVER = (X500.hover_speed_rad_s,) * 4


def battery(**parameters):
    return Battery(X500, Parameters({"SIM_BAT_MIN_PCT": 0.0, **parameters}, defaults=X500.parameters))


def drain(full, seconds, speeds=HOVER, *, armed=True):
    for _ in range(round(seconds * 10)):
        full.step(0.1, speeds, armed=armed)
    return full


def test_a_full_battery_at_rest_has_its_charged_voltage():
    resting = drain(battery(), 1.0, (0.0,) * 4)
    assert resting.current_a == X500.battery.electronics_a
    assert resting.voltage_v == pytest.approx(4 * 4.05, abs=0.02)
    assert resting.charge == pytest.approx(1.0, abs=1e-3)


def test_hovering_empties_it_in_about_a_quarter_of_an_hour():
    flying = drain(battery(), 600.0)
    assert 15 < flying.current_a < 30
    assert 0.2 < flying.charge < 0.45
    assert flying.voltage_v < 4 * (3.6 + 0.45 * 0.45)  # and it sags below its voltage at rest


def test_what_is_drawn_is_what_is_missing():
    flying, drawn_mah = battery(), 0.0
    for _ in range(3000):
        flying.step(0.1, HOVER, armed=True)
        drawn_mah += flying.current_a * 0.1 / 3.6
    assert 1.0 - flying.charge == pytest.approx(drawn_mah / X500.battery.capacity_mah, rel=1e-6)


def test_twice_the_speed_is_eight_times_the_power():
    slow, fast = battery(), battery()
    slow.step(0.1, (300.0,) * 4, armed=True)
    fast.step(0.1, (600.0,) * 4, armed=True)
    own_a = X500.battery.electronics_a
    assert (fast.current_a - own_a) / (slow.current_a - own_a) == pytest.approx(8.0, rel=1e-3)


def test_it_keeps_what_a_parameter_says():
    assert drain(battery(SIM_BAT_MIN_PCT=90.0), 300.0).charge == pytest.approx(0.9)


def test_a_floor_that_is_lowered_lets_it_fall_on_and_one_raised_gives_nothing_back():
    parameters = Parameters({"SIM_BAT_MIN_PCT": 90.0})
    falling = drain(Battery(X500, parameters), 300.0)
    parameters.set("SIM_BAT_MIN_PCT", 50.0)
    low = drain(falling, 100.0).charge
    assert low < 0.9
    parameters.set("SIM_BAT_MIN_PCT", 95.0)
    assert drain(falling, 100.0).charge == low


def test_by_time_it_drains_while_armed_only():
    timed = battery(SIM_BAT_DRAIN=100.0)
    assert drain(timed, 20.0, armed=False).charge == 1.0
    assert drain(timed, 20.0).charge == pytest.approx(0.8, abs=1e-6)
