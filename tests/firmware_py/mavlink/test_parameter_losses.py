"""A list over a bad link: the client asks again for what is missing, by index, as MAVSDK and stations do."""

import pytest

from firmware_py.parameters import DECLARATIONS
from wire.dialect import mavlink


def heard(messages):
    return {
        message.param_index: message.param_id
        for message in messages
        if message.get_type() == "PARAM_VALUE" and message.param_index < message.param_count
    }


@pytest.mark.parametrize("seed", range(5))
def test_the_list_completes(peer, make_lossy_peer, seed):
    client = make_lossy_peer(peer, seed=seed)
    names = {}
    for _ in range(5):  # the request itself may get lost
        client.send(mavlink.MAVLink_param_request_list_message(1, 1))
        names |= heard(client.advance(1.0))
        if names:
            break
    assert len(names) > len(DECLARATIONS) // 2
    for _ in range(8):
        missing = set(range(len(DECLARATIONS))) - set(names)
        if not missing:
            break
        for index in sorted(missing):
            client.send(mavlink.MAVLink_param_request_read_message(1, 1, b"", index))
        names |= heard(client.advance(0.5))
    assert names == {index: declared.name for index, declared in enumerate(DECLARATIONS)}


@pytest.mark.parametrize("seed", range(5))
def test_a_set_arrives_and_is_answered(autopilot, peer, make_lossy_peer, seed):
    client = make_lossy_peer(peer, seed=seed, loss=0.3)
    for _ in range(10):
        client.send(mavlink.MAVLink_param_set_message(1, 1, b"MIS_TAKEOFF_ALT", 4.0, 9))
        if any(m.get_type() == "PARAM_VALUE" and m.param_value == 4.0 for m in client.advance(0.5)):
            break
    else:
        pytest.fail("no answer to ten requests")
    assert autopilot.parameters.value("MIS_TAKEOFF_ALT") == 4.0
    assert autopilot.parameters.version == 1
