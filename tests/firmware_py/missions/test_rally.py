import pytest

from firmware_py.missions.flight import View
from firmware_py.missions.items import Do, PlanType
from firmware_py.missions.rally import DestinationKind, destination
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from tests.firmware_py.missions.mission_world import PROJECTION, placed, plan, waypoint

NEAR, FAR, OF_HOME = (40, 0, 5), (100, 0, 5), (6, 0, 5)
LANDING = (70, 0, 0)


def goes_to(rtl_type, position, *, rally=(), landing=False):
    store = MissionStore()
    store.replace(PlanType.RALLY, plan(*[placed(Do.RALLY_POINT, *place) for place in rally]))
    if landing:
        store.replace(PlanType.MISSION, plan(waypoint(0, 10, 10), placed(Do.LAND, *LANDING)))
        store.valid = True
    view = View(projection=PROJECTION, home_ned_m=(0.0, 0.0, 0.0), position_ned_m=position)
    found = destination(view, store, Parameters({"RTL_TYPE": rtl_type}))
    return found.kind, found.position_ned_m


@pytest.mark.parametrize(
    ("rtl_type", "north", "rally", "landing", "kind", "place"),
    [
        (0, 50.0, [], False, DestinationKind.HOME, (0, 0, 0)),
        (0, 50.0, [NEAR, FAR], False, DestinationKind.RALLY, (40, 0, -5)),
        (0, 90.0, [NEAR, FAR], False, DestinationKind.RALLY, (100, 0, -5)),
        (0, 15.0, [NEAR], False, DestinationKind.HOME, (0, 0, 0)),
        (0, 8.0, [OF_HOME], False, DestinationKind.HOME, (0, 0, 0)),
        (0, 70.0, [], True, DestinationKind.HOME, (0, 0, 0)),
        (1, 2.0, [FAR], False, DestinationKind.RALLY, (100, 0, -5)),
        (1, 2.0, [], False, DestinationKind.HOME, (0, 0, 0)),
        (1, 2.0, [FAR], True, DestinationKind.MISSION_LANDING, LANDING),
        (2, 2.0, [NEAR], True, DestinationKind.MISSION_LANDING, LANDING),
        (2, 60.0, [NEAR], False, DestinationKind.HOME, (0, 0, 0)),
        (3, 45.0, [NEAR], True, DestinationKind.RALLY, (40, 0, -5)),
        (3, 65.0, [NEAR], True, DestinationKind.MISSION_LANDING, LANDING),
        (3, 5.0, [NEAR], True, DestinationKind.HOME, (0, 0, 0)),
    ],
)
def test_where_a_return_goes(rtl_type, north, rally, landing, kind, place):
    found, position = goes_to(rtl_type, (north, 0.0, -20.0), rally=rally, landing=landing)
    assert found is kind
    assert position == pytest.approx(place, abs=1e-3)


def test_there_is_no_return_before_home_is_known():
    assert destination(View(projection=PROJECTION), MissionStore(), Parameters()) is None
