from math import nan

import pytest

from firmware_py.missions.checks import mission_faults
from firmware_py.missions.flight import VehicleView
from firmware_py.missions.geofence import Geofence
from firmware_py.missions.items import Do, PlanType
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from tests.firmware_py.missions.mission_world import PROJECTION, doing, placed, plan, waypoint


def checked(*makers, fence=(), landed=True, home=(0.0, 0.0, 0.0), **parameters):
    store, values = MissionStore(), Parameters(parameters)
    store.replace(PlanType.FENCE, plan(*fence))
    view = VehicleView(projection=PROJECTION, home_ned_m=home, landed=landed)
    valid, texts = mission_faults(plan(*makers), view, values, Geofence(store, values))
    return valid, [text.text for text in texts]


CIRCLE = placed(Do.CIRCLE_INCLUSION, 0, 0, params=(50.0, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    "makers",
    [
        [waypoint(0, 10, 10)],
        [placed(Do.TAKEOFF, 0, 0, 10), waypoint(0, 10, 10), placed(Do.LAND, 0, 0, 0)],
        [doing(Do.CHANGE_SPEED, 1, 5), placed(Do.TAKEOFF, 0, 0, 10), doing(Do.RETURN_TO_LAUNCH)],
        [waypoint(0, 10, nan)],
        [waypoint(nan, nan, 10)],
        [waypoint(0, 10, 10), doing(Do.JUMP, 0, 2)],
    ],
)
def test_missions_that_can_be_flown(makers):
    assert checked(*makers) == (True, [])


@pytest.mark.parametrize(
    ("makers", "text"),
    [
        ([placed(Do.LAND, 0, 0, 0)], "Mission rejected: starts with landing"),
        ([doing(Do.CONDITION_DELAY, 3)], "Mission rejected: item 1: unsupported cmd: 112"),
        (
            [placed(Do.VTOL_TAKEOFF, 0, 0, 10)],
            "Mission rejected: Mission contains VTOL items but vehicle is not a VTOL",
        ),
        ([placed(Do.TAKEOFF, 0, 0, 0)], "Mission rejected: Takeoff altitude below home altitude!"),
        (
            [waypoint(0, 10, 10), placed(Do.TAKEOFF, 0, 0, 10)],
            "Mission rejected: takeoff not first waypoint item",
        ),
        (
            [waypoint(0, 10, 10), doing(Do.JUMP, 7, 2)],
            "Mission rejected: item 2 jumps to item 8 of 2",
        ),
        (
            [waypoint(0, 10, 10), placed(Do.CONDITION_GATE, 0, 10, 10), waypoint(0, 20, 10)],
            "Distance between waypoint and gate too close: 0.00 meters",
        ),
    ],
)
def test_missions_that_cannot_be_flown_and_why(makers, text):
    assert checked(*makers) == (False, [text])


def test_a_landing_may_be_first_in_flight():
    assert checked(placed(Do.LAND, 0, 0, 0), landed=False)[0]


def test_places_outside_the_fence():
    assert checked(waypoint(0, 40, 10), fence=[CIRCLE]) == (True, [])
    valid, texts = checked(waypoint(0, 40, 10), waypoint(0, 60, 10), fence=[CIRCLE])
    assert not valid
    assert texts == ["Geofence violation for waypoint 2: outside circle of item 1"]
    assert not checked(waypoint(0, 40, 10), GF_MAX_VER_DIST=9.0)[0]


def test_a_far_first_place_is_a_warning_only():
    assert checked(waypoint(0, 200, 10), MIS_DIST_1WP=150.0) == (
        True,
        ["First waypoint far away from home: 200m. Correct mission loaded?"],
    )
    assert checked(waypoint(0, 200, 10), MIS_DIST_1WP=0.0) == (True, [])


def test_without_home_a_mission_cannot_be_checked():
    assert checked(waypoint(0, 10, 10), home=None) == (
        False,
        ["Not yet ready for mission, no position lock."],
    )
    assert checked() == (False, [])
