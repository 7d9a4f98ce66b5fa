import pytest

from firmware_py.missions.flight import VehicleView
from firmware_py.missions.items import Do, PlanType
from firmware_py.missions.store import MissionStore
from firmware_py.navigator import return_place
from firmware_py.parameters import Parameters
from tests.firmware_py.missions.mission_world import PROJECTION, placed, plan, waypoint

NEAR, FAR, OF_HOME = (40, 0, 5), (100, 0, 5), (6, 0, 5)
HOME, LANDING = (0, 0, 0), (70, 0, 0)


def place_for(rtl_type, position, *, rally=(), landing=False):
    store = MissionStore()
    store.replace(PlanType.RALLY, plan(*[placed(Do.RALLY_POINT, *place) for place in rally]))
    if landing:
        store.replace(PlanType.MISSION, plan(waypoint(0, 10, 10), placed(Do.LAND, *LANDING)))
        store.valid = True
    view = VehicleView(projection=PROJECTION, home_ned_m=(0.0, 0.0, 0.0), position_ned_m=position)
    return return_place(view, store, Parameters({"RTL_TYPE": rtl_type}))


@pytest.mark.parametrize(
    ("rtl_type", "north", "rally", "landing", "place"),
    [
        (0, 50.0, [], False, HOME),
        (0, 50.0, [NEAR, FAR], False, (40, 0, -5)),
        (0, 90.0, [NEAR, FAR], False, (100, 0, -5)),
        (0, 15.0, [NEAR], False, HOME),
        (0, 8.0, [OF_HOME], False, HOME),
        (0, 70.0, [], True, HOME),
        (1, 2.0, [FAR], False, (100, 0, -5)),
        (1, 2.0, [], False, HOME),
        (1, 2.0, [FAR], True, LANDING),
        (2, 2.0, [NEAR], True, LANDING),
        (2, 60.0, [NEAR], False, HOME),
        (3, 45.0, [NEAR], True, (40, 0, -5)),
        (3, 65.0, [NEAR], True, LANDING),
        (3, 5.0, [NEAR], True, HOME),
    ],
)
def test_where_a_return_goes(rtl_type, north, rally, landing, place):
    position = place_for(rtl_type, (north, 0.0, -20.0), rally=rally, landing=landing)
    assert position == pytest.approx(place, abs=1e-3)


def test_there_is_no_return_before_home_is_known():
    assert return_place(VehicleView(projection=PROJECTION), MissionStore(), Parameters()) is None
