from math import atan2, cos, nan, pi, remainder, sin, tau

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from firmware_py.missions.flight import VehicleView
from firmware_py.missions.geofence import Geofence, fence_fault
from firmware_py.missions.items import Do, PlanType
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from tests.firmware_py.missions.mission_world import PROJECTION, placed, plan

SQUARE = [(-20, -20), (-20, 20), (20, 20), (20, -20)]


def polygon(command, corners, count=None):
    params = (float(count or len(corners)), 0.0, 0.0, 0.0)
    return [placed(command, *corner, params=params) for corner in corners]


def circle(command, north, east, radius):
    return placed(command, north, east, params=(float(radius), 0.0, 0.0, 0.0))


def fence_of(*makers, **parameters):
    store = MissionStore()
    store.replace(PlanType.FENCE, plan(*makers))
    view = VehicleView(projection=PROJECTION, home_ned_m=(0.0, 0.0, 0.0), landed=False)
    fence = Geofence(store, Parameters(parameters))
    fence.check(view)
    return fence, view, store


def breach_at(fence, view, north, east, up=0.0):
    return fence.breach_at((north, east, -up), view)


def test_without_a_fence_everything_is_allowed():
    fence, view, _ = fence_of()
    assert breach_at(fence, view, 1e6, 1e6, 1e4) is None


def test_an_inclusion_polygon_is_named_when_left():
    fence, view, _ = fence_of(*polygon(Do.POLYGON_INCLUSION, SQUARE))
    assert breach_at(fence, view, 19.9, -19.9, 1000) is None
    assert breach_at(fence, view, 20.1, 0) == "outside polygon of items 1 to 4"


def test_all_shapes_are_checked():
    fence, view, _ = fence_of(
        circle(Do.CIRCLE_INCLUSION, 0, 0, 50), *polygon(Do.POLYGON_EXCLUSION, [(10, 10), (10, 20), (20, 15)])
    )
    assert breach_at(fence, view, 0, 30) is None
    assert breach_at(fence, view, 13, 15) == "inside polygon of items 2 to 4"
    assert breach_at(fence, view, 0, 51) == "outside circle of item 1"


def test_distance_and_height_from_home():
    fence, view, _ = fence_of(GF_MAX_HOR_DIST=30.0, GF_MAX_VER_DIST=20.0)
    assert breach_at(fence, view, 20, 20, 19.9) is None
    assert breach_at(fence, view, 30, 0) == "farther from home than 30 m"
    assert breach_at(fence, view, 0, 0, 20) == "higher above home than 20 m"
    view.home_ned_m = (100.0, 0.0, -100.0)
    assert breach_at(fence, view, 100, 20, 110) is None


def test_changed_parameters_and_plans_take_effect():
    store, parameters = MissionStore(), Parameters()
    view = VehicleView(projection=PROJECTION, home_ned_m=(0.0, 0.0, 0.0), position_ned_m=(30.0, 0.0, 0.0))
    fence = Geofence(store, parameters)
    assert fence.check(view) is None
    parameters.set("GF_MAX_HOR_DIST", 25.0)
    assert fence.check(view) == "farther from home than 25 m"
    parameters.set("GF_MAX_HOR_DIST", 0.0)
    store.replace(PlanType.FENCE, plan(circle(Do.CIRCLE_INCLUSION, 0, 0, 20)))
    assert fence.check(view) == "outside circle of item 1"
    store.clear(PlanType.FENCE)
    assert fence.check(view) is None


@pytest.mark.parametrize(
    ("makers", "text"),
    [
        (
            [circle(Do.CIRCLE_INCLUSION, 5e5, 5e5, 0)],
            "Geofence invalid, doesn't contain Home position: circle of item 1",
        ),
        (
            polygon(Do.POLYGON_EXCLUSION, SQUARE),
            "Geofence invalid, excludes Home position: polygon of items 1 to 4",
        ),
    ],
)
def test_a_shape_that_home_breaches_is_left_out_with_a_text(makers, text):
    fence, view, _ = fence_of(*makers)
    assert [said.text for said in fence.take_texts()] == [text]
    assert breach_at(fence, view, 0, 0) is None
    assert fence.take_texts() == []


def test_a_shape_that_the_vehicle_breaches_at_upload_is_left_out_in_flight_only():
    for landed, left_out in [(False, True), (True, False)]:
        fence, view, store = fence_of()
        view.position_ned_m, view.landed = (60.0, 0.0, -5.0), landed
        store.replace(PlanType.FENCE, plan(circle(Do.CIRCLE_INCLUSION, 0, 0, 50)))
        assert (fence.check(view) is None) == left_out
        assert bool(fence.take_texts()) == left_out


def test_prediction_looks_ahead_of_a_fast_vehicle():
    ahead, view, _ = fence_of(circle(Do.CIRCLE_INCLUSION, 0, 0, 50), GF_PREDICT=1)
    late, _, _ = fence_of(circle(Do.CIRCLE_INCLUSION, 0, 0, 50))
    view.position_ned_m, view.velocity_ned_m_s = (40.0, 0.0, -5.0), (10.0, 0.0, 0.0)
    assert ahead.check(view) == "outside circle of item 1"
    assert late.check(view) is None
    view.velocity_ned_m_s = (-10.0, 0.0, 0.0)
    assert ahead.check(view) is None


@pytest.mark.parametrize(
    ("makers", "fault"),
    [
        (polygon(Do.POLYGON_INCLUSION, SQUARE), None),
        (polygon(Do.POLYGON_INCLUSION, SQUARE[:2]), "Fence item 1: a polygon of 2 vertices, it needs 3"),
        (polygon(Do.POLYGON_INCLUSION, SQUARE, 5), "Fence item 1: a polygon of 5 vertices, 4 given"),
        (
            [*polygon(Do.POLYGON_INCLUSION, SQUARE[:3]), *polygon(Do.POLYGON_EXCLUSION, SQUARE[:3], 4)],
            "Fence item 4: a polygon of 4 vertices, 3 given",
        ),
        (
            [*polygon(Do.POLYGON_INCLUSION, SQUARE[:2], 4), *polygon(Do.POLYGON_EXCLUSION, SQUARE[2:], 4)],
            "Fence item 1: a polygon of 4 vertices, 2 given",
        ),
        ([circle(Do.CIRCLE_INCLUSION, 0, 0, 5), *polygon(Do.POLYGON_EXCLUSION, SQUARE)], None),
        (
            [placed(Do.POLYGON_INCLUSION, 0, 0, params=(nan, 0, 0, 0))],
            "Fence item 1: a polygon of 0 vertices, it needs 3",
        ),
    ],
)
def test_faults_of_a_fence(makers, fault):
    assert fence_fault(plan(*makers)) == fault


def winding_number(corners, north, east):
    """The winding number of a polygon about a place: the sum of the angles of its edges."""
    angle = 0.0
    bearings = [atan2(corner[1] - east, corner[0] - north) for corner in corners]
    for one, other in zip(bearings, [*bearings[1:], bearings[0]], strict=True):
        angle += remainder(other - one, tau)
    return round(angle / tau)


def distance_to_edge(corners, north, east):
    minimum = 1e9
    for (n1, e1), (n2, e2) in zip(corners, [*corners[1:], corners[0]], strict=True):
        dn, de = n2 - n1, e2 - e1
        length2 = dn * dn + de * de
        share = 0.0 if length2 == 0 else max(0.0, min(1.0, ((north - n1) * dn + (east - e1) * de) / length2))
        minimum = min(minimum, ((north - n1 - share * dn) ** 2 + (east - e1 - share * de) ** 2) ** 0.5)
    return minimum


@settings(max_examples=300)
@given(
    radii=st.lists(st.floats(5, 100), min_size=3, max_size=12),
    start=st.floats(0, tau),
    north=st.floats(-120, 120),
    east=st.floats(-120, 120),
)
def test_star_shaped_polygons_agree_with_the_winding_number(radii, start, north, east):
    steps = len(radii)
    corners = [
        (radius * cos(start + tau * step / steps), radius * sin(start + tau * step / steps))
        for step, radius in enumerate(radii)
    ]
    assume(distance_to_edge(corners, north, east) > 0.01)
    assume(distance_to_edge(corners, 0, 0) > 0.01)
    fence, view, _ = fence_of(*polygon(Do.POLYGON_INCLUSION, corners))
    assert winding_number(corners, 0, 0) == 1  # home is inside, so the shape is kept
    inside = winding_number(corners, north, east) != 0
    assert (breach_at(fence, view, north, east) is None) == inside


def test_the_winding_number_itself():
    assert winding_number(SQUARE, 0, 0) in (1, -1)
    assert winding_number(SQUARE, 30, 0) == 0
    assert abs(remainder(pi + tau, tau)) == pytest.approx(pi)
