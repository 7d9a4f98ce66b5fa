from math import cos, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.vehicle.geodesy import EARTH_RADIUS_M, GeodeticPoint, LocalProjection

HOME = GeodeticPoint(47.397742, 8.545594, 489.0)

origins = st.builds(
    GeodeticPoint,
    st.floats(-85, 85),
    st.floats(-180, 180),
    st.floats(-400, 8000),
)
metres = st.floats(-20_000, 20_000)


@given(origin=origins, north=metres, east=metres, down=metres)
def test_to_geodetic_and_back_is_the_same_place(origin, north, east, down):
    projection = LocalProjection(origin)
    back = projection.to_local(projection.to_geodetic((north, east, down)))
    assert back == pytest.approx((north, east, down), abs=1e-5)


def test_the_origin_is_exactly_itself():
    projection = LocalProjection(HOME)
    assert projection.to_geodetic((0.0, 0.0, 0.0)) == HOME
    assert projection.to_local(HOME) == (0.0, 0.0, 0.0)


def test_a_millimetre_is_resolved():
    projection = LocalProjection(HOME)
    assert projection.to_local(projection.to_geodetic((1e-3, -1e-3, 0.0))) == pytest.approx(
        (1e-3, -1e-3, 0.0), abs=1e-7
    )


def test_north_east_and_up_change_the_right_coordinates():
    projection = LocalProjection(HOME)
    degree_m = EARTH_RADIUS_M * radians(1.0)
    north = projection.to_geodetic((100.0, 0.0, 0.0))
    assert north.latitude_deg == pytest.approx(HOME.latitude_deg + 100.0 / degree_m, abs=1e-9)
    assert north.longitude_deg == pytest.approx(HOME.longitude_deg, abs=1e-12)
    east = projection.to_geodetic((0.0, 100.0, -10.0))
    step_deg = 100.0 / (degree_m * cos(radians(HOME.latitude_deg)))
    assert east.longitude_deg == pytest.approx(HOME.longitude_deg + step_deg, abs=1e-9)
    assert east.altitude_m == 499.0


def test_distance_from_the_origin_is_exact_on_the_sphere():
    # A quarter of the circumference, east along the equator.
    projection = LocalProjection(GeodeticPoint(0.0, 0.0, 0.0))
    quarter_m = EARTH_RADIUS_M * radians(90.0)
    assert projection.to_geodetic((0.0, quarter_m, 0.0)).longitude_deg == pytest.approx(90.0)
    assert projection.to_local(GeodeticPoint(0.0, 90.0, 0.0)) == pytest.approx(
        (0.0, quarter_m, 0.0), abs=1e-6
    )


def test_longitude_stays_in_range_across_the_date_line():
    point = LocalProjection(GeodeticPoint(10.0, 179.999, 0.0)).to_geodetic((0.0, 1000.0, 0.0))
    assert -180.0 <= point.longitude_deg < -179.9
