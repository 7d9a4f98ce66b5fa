from math import nan

import pytest

from tests.firmware_py.mavlink.conftest import HOME
from wire.dialect import mavlink


def target(lat=HOME.latitude_deg + 1e-4, vel=(1.0, 2.0, 0.0), capabilities=3):
    return mavlink.MAVLink_follow_target_message(
        0,
        capabilities,
        round(lat * 1e7),
        round(HOME.longitude_deg * 1e7),
        HOME.altitude_m + 2.0,
        list(vel),
        [0.0] * 3,
        [1.0, 0.0, 0.0, 0.0],
        [0.0] * 3,
        [0.0] * 3,
        0,
    )


def test_a_target_is_followed_in_the_local_frame(autopilot, peer):
    peer.send(target())
    ((name, place, velocity),) = autopilot.calls
    assert name == "follow_target"
    assert place == pytest.approx((11.12, 0.0, -2.0), abs=0.02)
    assert velocity == (1.0, 2.0, 0.0)


@pytest.mark.parametrize("odd", [{"capabilities": 1}, {"vel": (nan, 0.0, 0.0)}])
def test_a_target_without_a_velocity_stands(autopilot, peer, odd):
    peer.send(target(**odd))
    assert autopilot.calls[0][2] == (0.0, 0.0, 0.0)


def test_a_target_nowhere_on_earth_is_dropped(autopilot, peer):
    peer.send(target(lat=120.0))
    assert autopilot.calls == []


@pytest.mark.parametrize(("system", "heard"), [(1, True), (2, False)])
def test_the_origin_can_be_told(autopilot, peer, system, heard):
    peer.send(mavlink.MAVLink_set_gps_global_origin_message(system, 473977420, 85455940, 488000))
    assert bool(autopilot.calls) == heard
    if heard:
        assert autopilot.calls[0][1].altitude_m == 488.0
