"""The standard atmosphere."""

import pytest

from framerunner.vehicle.atmosphere import pressure_altitude_m, pressure_hpa, pressure_pa, temperature_k


def test_the_values_of_its_table():
    assert pressure_hpa(0.0) == pytest.approx(1013.25)
    assert pressure_pa(1000.0) == pytest.approx(89876.0, abs=5.0)  # ISO 2533
    assert temperature_k(1000.0) == pytest.approx(281.65)


@pytest.mark.parametrize("altitude_m", [-400.0, 0.0, 489.0, 1500.0, 9000.0])
def test_the_altitude_of_a_pressure_is_its_inverse(altitude_m):
    assert pressure_altitude_m(pressure_pa(altitude_m)) == pytest.approx(altitude_m, abs=1e-6)
