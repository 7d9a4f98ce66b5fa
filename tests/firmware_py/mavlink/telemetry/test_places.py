import pytest

from wire.dialect import mavlink


@pytest.mark.parametrize(("system", "heard"), [(1, True), (2, False)])
def test_the_origin_can_be_told(autopilot, peer, system, heard):
    peer.send(mavlink.MAVLink_set_gps_global_origin_message(system, 473977420, 85455940, 488000))
    assert bool(autopilot.calls) == heard
    if heard:
        assert autopilot.calls[0][1].altitude_m == 488.0
