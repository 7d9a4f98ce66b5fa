from math import nan
from struct import pack, unpack

import pytest

from firmware_py.parameters import DECLARATIONS
from firmware_py.status import CommandResult
from framerunner.wire.dialect import mavlink

INT32, UINT32, REAL32 = 6, 5, 9
TAKEOFF_ALTITUDE = b"MIS_TAKEOFF_ALT"


def request_list(target=(1, 1)):
    return mavlink.MAVLink_param_request_list_message(*target)


def read(name=b"", index=-1, target=(1, 1)):
    return mavlink.MAVLink_param_request_read_message(*target, name, index)


def set_(name, value, kind=REAL32, target=(1, 1)):
    if kind == INT32:
        value = unpack("<f", pack("<i", value))[0]
    return mavlink.MAVLink_param_set_message(*target, name, value, kind)


def values(received, link="onboard"):
    return [m for on, m in received if on == link and m.get_type() == "PARAM_VALUE"]


def as_int(message):
    return unpack("<i", pack("<f", message.param_value))[0]


def test_the_list_is_the_hash_and_then_all_densely(autopilot, peer):
    peer.send(request_list())
    listed = values(peer.advance(1.0))
    first, rest = listed[0], listed[1:]
    assert (first.param_id, first.param_index, first.param_type) == ("_HASH_CHECK", 65535, UINT32)
    assert pack("<f", first.param_value) == pack("<I", autopilot.parameters.hash())
    assert [message.param_index for message in rest] == list(range(len(DECLARATIONS)))
    assert {message.param_count for message in listed} == {len(DECLARATIONS)}
    for message, declared in zip(rest, DECLARATIONS, strict=True):
        assert message.param_id == declared.name
        value = as_int(message) if message.param_type == INT32 else message.param_value
        assert value == pytest.approx(declared.default, rel=1e-6)


def test_a_list_is_paced_and_for_its_link_only(peer):
    peer.send(request_list(), "ground")
    peer.node.update(peer.time_us)
    received = peer.take()
    assert len(values(received, "ground")) == 4
    assert values(peer.advance(1.0), "onboard") == []


def test_the_right_hash_ends_the_list(autopilot, peer):
    peer.send(request_list())
    hash_as_float = unpack("<f", pack("<I", autopilot.parameters.hash()))[0]
    peer.send(set_(b"_HASH_CHECK", hash_as_float, UINT32))
    assert values(peer.advance(1.0)) == []


@pytest.mark.parametrize(
    ("question", "name"),
    [
        (read(b"MIS_TAKEOFF_ALT"), "MIS_TAKEOFF_ALT"),
        (read(index=0), DECLARATIONS[0].name),
        (read(index=len(DECLARATIONS) - 1), DECLARATIONS[-1].name),
        (read(b"_HASH_CHECK"), "_HASH_CHECK"),
    ],
)
def test_read_by_name_or_index(peer, question, name):
    (answer,) = peer.ask(question)
    assert answer.param_id == name


@pytest.mark.parametrize(
    "question",
    [
        read(b"NO_SUCH"),
        read(index=len(DECLARATIONS)),
        read(index=-2),
        read(b"\xff\xfe\x00\x01"),
        read(b"MIS_TAKEOFF_ALT", target=(2, 1)),
        read(b"MIS_TAKEOFF_ALT", target=(0, 0)),
        set_(b"NO_SUCH", 1.0),
        set_(b"MIS_TAKEOFF_ALT", 3, INT32),
        set_(b"COM_OBL_RC_ACT", 4.0, REAL32),
        set_(b"MIS_TAKEOFF_ALT", 1.0, target=(1, 55)),
        request_list(target=(2, 1)),
    ],
)
def test_silence_as_px4(autopilot, peer, question):
    assert peer.ask(question) == []
    assert values(peer.advance(0.5)) == []
    assert autopilot.parameters.version == 0


def test_a_change_is_kept_and_broadcast(autopilot, peer):
    peer.send(set_(TAKEOFF_ALTITUDE, 1.5))
    received = peer.take()
    assert autopilot.parameters.value("MIS_TAKEOFF_ALT") == 1.5
    for link in ("onboard", "ground"):
        (echo,) = values(received, link)
        assert (echo.param_id, echo.param_value, echo.param_type) == ("MIS_TAKEOFF_ALT", 1.5, REAL32)


def test_whole_numbers_travel_bytewise(autopilot, peer):
    (echo,) = peer.ask(set_(b"COM_OBL_RC_ACT", 4, INT32))
    assert as_int(echo) == 4
    assert autopilot.parameters.integer("COM_OBL_RC_ACT") == 4


def test_setting_the_same_value_is_answered(peer):
    (echo,) = peer.ask(set_(TAKEOFF_ALTITUDE, 2.5))
    assert echo.param_value == 2.5


@pytest.mark.parametrize(
    ("name", "value", "kind"),
    [
        (TAKEOFF_ALTITUDE, -500.0, REAL32),
        (TAKEOFF_ALTITUDE, nan, REAL32),
        (TAKEOFF_ALTITUDE, float("inf"), REAL32),
        (b"COM_OBL_RC_ACT", 8, INT32),
        (b"SYS_AUTOSTART", 10040, INT32),
    ],
)
def test_what_cannot_be_is_answered_with_what_is_kept_and_a_reason(autopilot, peer, name, value, kind):
    before = autopilot.parameters.value(name.decode())
    (echo,) = peer.ask(set_(name, value, kind))
    assert (as_int(echo) if kind == INT32 else echo.param_value) == before
    (said,) = autopilot.texts
    assert said.text.startswith(f"Parameter refused: {name.decode()}: ")


def test_a_change_by_the_vehicle_is_broadcast_too(autopilot, peer):
    autopilot.parameters.set("COM_OF_LOSS_T", 0.5)
    assert [m.param_value for m in values(peer.take(), "ground")] == [0.5]


def test_a_repeated_refusal_is_reported_once_but_answered_each_time(autopilot, peer):
    bad = set_(TAKEOFF_ALTITUDE, -1.0)
    assert [len(peer.ask(bad)) for _ in range(6)] == [1] * 6
    assert [said.severity for said in autopilot.texts] == [4]
    peer.ask(set_(TAKEOFF_ALTITUDE, -2.0))
    assert len(autopilot.texts) == 2
    peer.advance(6.0)
    peer.ask(set_(TAKEOFF_ALTITUDE, -2.0))
    assert len(autopilot.texts) == 1  # the update took the others away


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


@pytest.fixture
def storage(autopilot, peer):
    """Sends PREFLIGHT_STORAGE, with a parameter that is not at its default; the result."""
    autopilot.parameters.set("MIS_TAKEOFF_ALT", 7.0)

    def send(action):
        acks = [m for m in peer.ask(peer.long(245, action)) if m.get_type() == "COMMAND_ACK"]
        return [ack.result for ack in acks]

    return send


@pytest.mark.parametrize("action", [2.0, 4.0])
def test_reset_gives_defaults_again(autopilot, storage, action):
    assert storage(action) == [CommandResult.ACCEPTED]
    assert autopilot.parameters.changed() == {}


@pytest.mark.parametrize("action", [0.0, 3.0])
def test_what_needs_nothing_done_is_accepted(autopilot, storage, action):
    assert storage(action) == [CommandResult.ACCEPTED]
    assert autopilot.parameters.changed() == {"MIS_TAKEOFF_ALT": 7.0}


def test_saving_calls_the_storage(autopilot, storage):
    asked = []
    autopilot.parameters.on_save(lambda: asked.append(True))
    assert storage(1.0) == [CommandResult.ACCEPTED]
    assert asked == [True]


def test_saving_without_a_file_fails_with_a_text(autopilot, storage):
    assert storage(1.0) == [CommandResult.FAILED]
    (said,) = autopilot.texts
    assert said.text == "Parameters are not saved: start it with --parameters FILE"


@pytest.mark.parametrize("action", [nan, -1.0, 0.5, 99.0])
def test_what_is_no_action_is_denied(storage, action):
    assert storage(action) == [CommandResult.DENIED]


def test_not_while_armed(autopilot, storage):
    autopilot.status.armed = True
    assert storage(2.0) == [CommandResult.TEMPORARILY_REJECTED]
    assert autopilot.parameters.changed() == {"MIS_TAKEOFF_ALT": 7.0}
