from struct import pack, unpack

import pytest

from firmware_py.parameters import DECLARATIONS
from framerunner.wire.dialect import mavlink

INT32, REAL32 = 6, 9
ACCEPTED, UNSUPPORTED = 0, 1


def read(name=b"", index=-1, target=(1, 1)):
    return mavlink.MAVLink_param_ext_request_read_message(*target, name, index)


def set_(name, value, kind=REAL32, target=(1, 1)):
    data = pack("<i" if kind == INT32 else "<f", value).ljust(128, b"\0")
    return mavlink.MAVLink_param_ext_set_message(*target, name, data, kind)


def value_of(message):
    data = message._param_value_raw[:4].ljust(4, b"\0")
    return unpack("<i" if message.param_type == INT32 else "<f", data)[0]


def test_the_list_is_dense_and_for_its_link_only(peer):
    peer.send(mavlink.MAVLink_param_ext_request_list_message(1, 1))
    received = peer.advance(1.0)
    listed = [m for link, m in received if m.get_type() == "PARAM_EXT_VALUE" and link == "onboard"]
    assert [m for link, m in received if m.get_type() == "PARAM_EXT_VALUE" and link != "onboard"] == []
    assert [m.param_index for m in listed] == list(range(len(DECLARATIONS)))
    for message, declared in zip(listed, DECLARATIONS, strict=True):
        assert (message.param_id, message.param_count) == (declared.name, len(DECLARATIONS))
        assert value_of(message) == pytest.approx(declared.default, rel=1e-6)


@pytest.mark.parametrize(
    "question", [read(b"MAV_TYPE"), read(index=[d.name for d in DECLARATIONS].index("MAV_TYPE"))]
)
def test_read_by_name_or_index(peer, question):
    (answer,) = peer.ask(question)
    assert (answer.param_id, value_of(answer), answer.param_type) == ("MAV_TYPE", 2, INT32)


@pytest.mark.parametrize(
    "question",
    [
        read(b"NO_SUCH"),
        read(index=len(DECLARATIONS)),
        read(b"MAV_TYPE", target=(2, 1)),
        set_(b"NO_SUCH", 1.0),
        set_(b"MIS_TAKEOFF_ALT", 1.0, target=(1, 100)),
        mavlink.MAVLink_param_ext_request_list_message(2, 1),
    ],
)
def test_silence(autopilot, peer, question):
    assert peer.ask(question) == []
    assert [m for _, m in peer.advance(0.5) if m.get_type().startswith("PARAM")] == []
    assert autopilot.parameters.version == 0


def test_a_set_is_acknowledged_and_broadcast(autopilot, peer):
    peer.send(set_(b"COM_OBL_RC_ACT", 4, INT32))
    received = peer.take()
    (answer,) = [m for _, m in received if m.get_type() == "PARAM_EXT_ACK"]
    assert (answer.param_id, value_of(answer), answer.param_result) == ("COM_OBL_RC_ACT", 4, ACCEPTED)
    assert {link for link, m in received if m.get_type() == "PARAM_VALUE"} == {"onboard", "ground"}
    assert autopilot.parameters.integer("COM_OBL_RC_ACT") == 4


@pytest.mark.parametrize(
    ("question", "kept"),
    [
        (set_(b"MIS_TAKEOFF_ALT", -1.0), 2.5),
        (set_(b"MIS_TAKEOFF_ALT", 3, INT32), 2.5),
        (set_(b"SYS_AUTOSTART", 10040, INT32), 4001),
    ],
)
def test_an_invalid_value_is_answered_with_the_kept_one(autopilot, peer, question, kept):
    (answer,) = peer.ask(question)
    assert answer.param_result == UNSUPPORTED
    assert value_of(answer) == kept
    assert autopilot.parameters.version == 0
