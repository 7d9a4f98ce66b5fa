"""MAVLink 2 signing, with pymavlink's own on the other side."""

from dataclasses import replace
from hashlib import sha256

import pytest

from firmware_py.mavlink.telemetry.profiles import GROUND, ONBOARD
from framerunner.wire.dialect import mavlink
from framerunner.wire.signing import Signing, SigningKey
from tests.node_input import deliver

KEY = SigningKey.from_text("correct horse battery staple")
OTHER_KEY = SigningKey(bytes(range(1, 33)))
BOOT_US = 1_790_000_000_000_000
RADIO = replace(GROUND, name="radio", trusted=False)
TICKS = (BOOT_US - 1_420_070_400_000_000) // 10  # signing's own time at boot


@pytest.fixture
def signed_peer(autopilot, make_peer):
    """A client of a drone with a key, on loopback and on a radio."""
    options = {"signing_key": KEY, "boot_unix_us": BOOT_US}
    return make_peer(autopilot, links=(ONBOARD, RADIO), node_options=options)


def give_key(packer, key=KEY, *, timestamp=TICKS, link_id=0):
    packer.signing.secret_key = key.secret
    packer.signing.timestamp = timestamp
    packer.signing.link_id = link_id
    packer.signing.sign_outgoing = True


def asked(peer, link):
    return peer.ask(peer.long(mavlink.MAV_CMD_REQUEST_MESSAGE, 148), link)


def test_a_key_is_hexadecimal_or_the_hash_of_a_passphrase():
    assert SigningKey.from_text("ab" * 32 + "\n").secret == bytes([0xAB] * 32)
    assert SigningKey.from_text(" secret \n").secret == sha256(b"secret").digest()


@pytest.mark.parametrize("text", ["", " \n", "00" * 32])
def test_what_is_no_key_is_refused(text):
    with pytest.raises(ValueError, match=r"zero|empty"):
        SigningKey.from_text(text)


def test_a_key_is_never_shown():
    assert KEY.secret.hex() not in f"{KEY!r}{KEY}"
    assert "correct" not in f"{KEY!r}{KEY}"


def test_pymavlink_with_the_key_believes_all_that_is_sent(signed_peer):
    reader = mavlink.MAVLink(None)
    reader.robust_parsing = True
    give_key(reader)
    signed_peer.node.update(1_000_000)
    packets = [data for link, data in signed_peer.node.take_output() if link == "radio"]
    messages = [message for data in packets for message in reader.parse_buffer(bytearray(data)) or []]
    assert len(messages) > 10
    assert all(message.get_signed() for message in messages)
    assert reader.signing.badsig_count == 0


def test_pymavlink_with_another_key_believes_nothing(signed_peer):
    reader = mavlink.MAVLink(None)
    reader.robust_parsing = True
    give_key(reader, OTHER_KEY)
    signed_peer.node.update(1_000_000)
    for _, data in signed_peer.node.take_output():
        for message in reader.parse_buffer(bytearray(data)) or []:
            assert message.get_type() == "BAD_DATA"


def test_who_has_the_key_is_answered(signed_peer):
    give_key(signed_peer.packer)
    assert asked(signed_peer, "radio")
    assert signed_peer.node._exchange.refused_packets == 0


def test_unsigned_packets_are_accepted_on_loopback_only(signed_peer):
    assert asked(signed_peer, "radio") == []
    assert signed_peer.node._exchange.refused_packets == 1
    assert asked(signed_peer, "onboard")


@pytest.mark.parametrize("link", ["onboard", "radio"])
def test_a_wrong_signature_is_refused_everywhere(signed_peer, link):
    give_key(signed_peer.packer, OTHER_KEY)
    assert asked(signed_peer, link) == []


def test_a_signed_packet_is_accepted_once(signed_peer):
    give_key(signed_peer.packer)
    packet = signed_peer.long(mavlink.MAV_CMD_REQUEST_MESSAGE, 148).pack(signed_peer.packer)
    deliver(signed_peer.node, "radio", packet)
    assert signed_peer.take()
    deliver(signed_peer.node, "radio", packet)
    assert signed_peer.take() == []


def test_each_stream_has_its_own_time(signed_peer):
    give_key(signed_peer.packer, link_id=3)
    assert asked(signed_peer, "radio")
    give_key(signed_peer.packer, timestamp=TICKS - 5_000_000, link_id=4)
    assert asked(signed_peer, "radio")


@pytest.mark.parametrize(("late_s", "heard"), [(59, True), (61, False)])
def test_a_new_stream_may_be_a_minute_late(signed_peer, late_s, heard):
    give_key(signed_peer.packer, timestamp=TICKS - late_s * 100_000)
    assert bool(asked(signed_peer, "radio")) is heard


def test_a_radio_need_not_sign(signed_peer):
    message = mavlink.MAVLink_radio_status_message(100, 100, 50, 10, 10, 0, 0)
    signed_peer.send(message, "radio")
    assert signed_peer.node._exchange.refused_packets == 0


def test_mavlink_1_cannot_be_signed(signed_peer):
    signed_peer.send(signed_peer.long(400, 1), "radio", force_mavlink1=True)
    assert signed_peer.take() == []
    assert signed_peer.autopilot.calls == []


def test_a_changed_packet_is_refused(signed_peer):
    give_key(signed_peer.packer)
    whole = signed_peer.long(mavlink.MAV_CMD_REQUEST_MESSAGE, 148).pack(signed_peer.packer)
    for place in (-1, -7, -13):  # signature, timestamp, link id
        broken = bytearray(whole)
        broken[place] ^= 1
        deliver(signed_peer.node, "radio", bytes(broken))
    assert signed_peer.take() == []
    assert signed_peer.node._exchange.refused_packets == 3


def setup_message(secret, *, timestamp=TICKS, target=(1, 1)):
    return mavlink.MAVLink_setup_signing_message(*target, list(secret), timestamp)


def test_setup_signing_turns_it_on_and_off(autopilot, make_peer):
    peer = make_peer(autopilot, links=(ONBOARD, RADIO), node_options={"boot_unix_us": BOOT_US})
    assert asked(peer, "radio")
    peer.send(setup_message(KEY.secret), "onboard")
    assert asked(peer, "radio") == []
    give_key(peer.packer)
    assert asked(peer, "radio")
    peer.send(setup_message(bytes(32)), "onboard")
    peer.packer.signing.sign_outgoing = False
    assert asked(peer, "radio")


def test_setup_signing_is_not_accepted_on_radios_and_not_forwarded(autopilot, make_peer):
    peer = make_peer(autopilot, links=(ONBOARD, RADIO))
    peer.meet_ground_station("onboard")
    peer.meet_ground_station("radio")
    peer.advance(0.1)
    peer.send(setup_message(KEY.secret, target=(0, 0)), "radio")
    peer.send(setup_message(KEY.secret), "radio")
    assert not [message for _, message in peer.take() if message.get_type() == "SETUP_SIGNING"]
    assert asked(peer, "radio")
    assert not any(KEY.secret.hex() in text.text for text in autopilot.texts)


def test_time_never_ends():
    signing = Signing(KEY, BOOT_US)
    signing.set_key(KEY, (1 << 48) - 1)
    assert len(signing.block(b"", 255)) == 13
    assert len(signing.block(b"", 255)) == 13
