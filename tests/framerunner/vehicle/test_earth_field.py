"""Earth's magnetic field."""

import pytest
from pygeomag import GeoMag

from framerunner.vehicle.earth_field import FIELD_YEAR, earth_field_ned_gauss


def test_the_model_gives_the_test_values_of_its_authors():
    """World Magnetic Model 2025, NOAA's table of test values: nanotesla at 80 degrees north, 2025.0."""
    field = GeoMag(coefficients_file="wmm/WMM_2025.COF").calculate(glat=80.0, glon=0.0, alt=0.0, time=2025.0)
    assert (field.x, field.y, field.z) == pytest.approx((6521.6, 145.9, 54791.5), abs=0.05)


def test_at_px4s_simulated_home_it_is_what_px4_has():
    assert earth_field_ned_gauss(47.397742, 8.545594, 489.0) == pytest.approx((0.22, 0.013, 0.43), abs=0.006)
    assert 2025.0 <= FIELD_YEAR < 2030.0


def test_the_poles_have_a_field_too():
    for latitude_deg, sign in ((-90.0, -1.0), (90.0, 1.0)):
        assert 0.4 < sign * earth_field_ned_gauss(latitude_deg, 0.0, 0.0)[2] < 0.7
