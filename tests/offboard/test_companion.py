"""The component by which the app reports its mission: what it sends, when, and that it does no harm."""

from __future__ import annotations

import asyncio
import socket

import pytest
from pymavlink.dialects.v20 import common as mavlink

from framerunner.wire.mission_tunnel import (
    DocumentAssembler,
    DocumentKind,
    MissionDetections,
    MissionState,
    decode_detections,
    decode_state,
    split_document,
)
from offboard.link import companion as module
from offboard.link.companion import Companion
from offboard.link.connections import _log
from offboard.link.telemetry import TelemetryFeed

SYSTEM = 3
STATE = MissionState(
    7, 4, 2, 5_000_000, 4_000_000, True, False, False, (0.5, 0.0, 0.0, 0.1), (1.0, 2.0, 3.0, 0.0)
)


class Forwarder:
    """MAVSDK's end of the connection: it forwards a vehicle's packets and takes the companion's."""

    def __init__(self, url):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.setblocking(False)
        self.companion = ("127.0.0.1", int(url.rpartition(":")[2]))
        assert url.startswith("udpout://127.0.0.1:")
        self._reader = mavlink.MAVLink(None)

    def forward(self, message, system=SYSTEM, component=1, version=2):
        sender = mavlink.MAVLink(None, srcSystem=system, srcComponent=component)
        self.socket.sendto(message.pack(sender, force_mavlink1=version == 1), self.companion)

    def forward_heartbeat(self, **source):
        self.forward(mavlink.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3), **source)

    def received(self):
        """All messages since the last call."""
        messages = []
        while True:
            try:
                messages += self._reader.parse_buffer(self.socket.recv(4096)) or []
            except BlockingIOError:
                return messages


def kinds(messages):
    return [message.get_type() for message in messages]


def payloads(messages, payload_type):
    return [
        bytes(message.payload[: message.payload_length])
        for message in messages
        if message.get_type() == "TUNNEL" and message.payload_type == payload_type
    ]


@pytest.fixture
def silent():
    """A companion whose link has not carried anything yet, and the other end of it."""
    companion = Companion()
    forwarder = Forwarder(companion.listen())
    yield companion, forwarder
    forwarder.socket.close()


@pytest.fixture
async def pair(silent):
    """A companion that was given its vehicle; the test calls its beats."""
    companion, forwarder = silent
    companion.announce(SYSTEM)
    forwarder.forward(mavlink.MAVLink_attitude_message(0, 0, 0, 0, 0, 0, 0))
    companion.beat()
    assert forwarder.received() == []
    yield companion, forwarder
    await companion.close()


async def test_it_sends_to_all_as_a_component_of_the_vehicle(pair):
    companion, forwarder = pair
    seen = MissionDetections(4_900_000, 320, 240, (1.0, -1.0, 2.0, -2.0, 0.5, 10.0))
    companion.send_state(STATE)
    companion.send_detections(seen)
    companion.send_text("mission: red.turning")
    messages = forwarder.received()
    assert {(message.get_srcSystem(), message.get_srcComponent()) for message in messages} == {(SYSTEM, 191)}
    assert [message.get_seq() for message in messages] == [0, 1, 2]
    assert kinds(messages) == ["TUNNEL", "TUNNEL", "STATUSTEXT"]
    assert [(message.target_system, message.target_component) for message in messages[:2]] == [(0, 0)] * 2
    (state,) = payloads(messages, 0x8F10)
    assert decode_state(state).state_index == 4
    (detections,) = payloads(messages, 0x8F11)
    assert decode_detections(detections) == seen
    assert (messages[2].text, messages[2].severity) == ("mission: red.turning", mavlink.MAV_SEVERITY_INFO)
    assert companion.sent == 3


@pytest.mark.parametrize("version", [1, 2])
async def test_each_heartbeat_answers_one_of_the_autopilot_s(pair, version):
    """MAVSDK takes any heartbeat of the system for the vehicle's: ours must end with the vehicle's."""
    companion, forwarder = pair
    for _ in range(100):
        companion.beat()
    forwarder.forward_heartbeat(component=100)  # a camera
    forwarder.forward_heartbeat(system=SYSTEM + 1)
    forwarder.forward(mavlink.MAVLink_sys_status_message(*[0] * 13))
    companion.beat()
    assert forwarder.received() == []
    forwarder.forward_heartbeat(version=version)
    companion.beat()
    companion.beat()
    (beat,) = forwarder.received()
    assert beat.get_type() == "HEARTBEAT"
    assert (beat.type, beat.autopilot) == (mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_AUTOPILOT_INVALID)
    assert beat.base_mode == 0


async def test_a_document_is_sent_at_once_then_again_and_again_two_pieces_a_second(pair):
    companion, forwarder = pair
    mission = split_document(DocumentKind.MISSION, {"source": "".join(map(str, range(900)))})[1]
    history = split_document(DocumentKind.HISTORY, {"transitions": []})[1]
    assert len(mission) > 5 and len(history) == 1
    companion.send_document(DocumentKind.MISSION, mission)
    companion.send_document(DocumentKind.HISTORY, history)
    sent = payloads(forwarder.received(), 0x8F12)
    assert sent == history  # at once
    companion.beat()
    companion.beat()
    sent += payloads(forwarder.received(), 0x8F12)
    assert sent == [*history, *mission[: module.PIECES_A_BEAT]]
    for _ in range(len(mission) // module.PIECES_A_BEAT):
        companion.beat()
    sent += payloads(forwarder.received(), 0x8F12)
    assembler = DocumentAssembler()
    assert sum(assembler.take(piece) is not None for piece in sent) == 2
    pieces_a_round = len(mission) + len(history)
    beats_a_second = round(1 / module.BEAT_S)
    for _ in range(pieces_a_round * beats_a_second // 2):
        companion.beat()
    repeated = payloads(forwarder.received(), 0x8F12)
    assert sorted(repeated) == sorted([*mission, *history])  # each once in a round


async def test_maps_wait_for_all_other_documents(pair):
    companion, forwarder = pair
    navigation = split_document(DocumentKind.MAP, {"goal": "explore"})[1]
    mission = split_document(DocumentKind.MISSION, {"source": "".join(map(str, range(900)))})[1]
    companion.send_document(DocumentKind.MAP, navigation)
    companion.send_document(DocumentKind.MISSION, mission)
    for _ in range(len(mission) // module.PIECES_A_BEAT):
        assert companion.is_sending(DocumentKind.MAP)
        companion.beat()
    companion.beat()
    assert not companion.is_sending(DocumentKind.MAP)
    assert navigation[0] in payloads(forwarder.received(), 0x8F12)


async def test_a_transition_is_sent_within_two_beats_of_being_taken(pair):
    companion, forwarder = pair
    noise = "".join(map(str, range(900)))
    companion.send_document(DocumentKind.MAP, split_document(DocumentKind.MAP, {"goal": noise})[1])
    texts = [f"state_{number} -> state_{number + 1}: frame.d < 0.{number}" for number in range(40)]
    history = split_document(DocumentKind.HISTORY, {"transitions": texts})[1][:5]  # as long as ten of them
    companion.beat()
    companion.send_document(DocumentKind.HISTORY, history)
    for _ in range(2):
        companion.beat()
    sent = payloads(forwarder.received(), 0x8F12)
    assert set(history) < set(sent)
    assert 2 * module.BEAT_S <= 0.1
    for _ in range(40):  # the map is not sent faster for it
        companion.send_document(DocumentKind.HISTORY, history)
        companion.beat()
    assert len(payloads(forwarder.received(), 0x8F12)) <= 40 * module.PIECES_A_BEAT + 2 + 4


async def test_of_a_document_only_the_newest_version_is_sent(pair):
    companion, forwarder = pair
    old = split_document(DocumentKind.HISTORY, {"transitions": ["".join(map(str, range(900)))]})[1]
    new = split_document(DocumentKind.HISTORY, {"transitions": [1]})[1]
    companion.send_document(DocumentKind.HISTORY, old)
    companion.beat()
    forwarder.received()
    companion.send_document(DocumentKind.HISTORY, new)
    for _ in range(50):
        companion.beat()
    assert set(payloads(forwarder.received(), 0x8F12)) == set(new)


async def test_a_state_is_repeated_while_no_tick_brings_another(pair, monkeypatch):
    companion, forwarder = pair
    now_s = 100.0
    monkeypatch.setattr(module.time, "monotonic", lambda: now_s)
    companion.send_state(STATE)
    companion.beat()
    now_s += module.SILENT_S / 2
    companion.beat()
    assert len(payloads(forwarder.received(), 0x8F10)) == 1
    now_s += module.SILENT_S
    companion.beat()
    companion.beat()
    assert [decode_state(state).time_us for state in payloads(forwarder.received(), 0x8F10)] == [
        STATE.time_us
    ]


async def test_the_final_document_is_sent_twice(pair, monkeypatch):
    companion, forwarder = pair
    monkeypatch.setattr(module, "FINAL_GAP_S", 0.0)
    pieces = split_document(DocumentKind.RESULT, {"reason": "".join(map(str, range(200)))})[1]
    assert len(pieces) > 1
    companion.send_document(DocumentKind.RESULT, pieces)
    await companion.send_finally(DocumentKind.RESULT)
    said = payloads(forwarder.received(), 0x8F12)
    assert all(said.count(piece) >= 2 for piece in pieces)
    assert 2 * module.FINAL_GAP_S <= 0.5


@pytest.mark.parametrize("length", [50, 51, 100, 130, 200, 500])
async def test_a_long_text_is_sent_in_pieces_that_can_be_joined(pair, length):
    companion, forwarder = pair
    text = "".join(chr(97 + number % 26) for number in range(length))
    companion.send_text(text)
    companion.send_text("short")
    *chunks, short = forwarder.received()
    assert "".join(chunk.text for chunk in chunks) == text[:200]
    assert [chunk.chunk_seq for chunk in chunks] == list(range(len(chunks)))
    assert len({chunk.id for chunk in chunks}) == 1
    assert bool(chunks[0].id) == (length > 50)
    assert length == 50 or len(chunks[-1].text) < 50  # a zero within says that it is the last
    assert (short.text, short.id) == ("short", 0)


async def test_what_fits_in_no_field_is_not_sent(pair, caplog):
    companion, forwarder = pair
    far = (1e300, 0.0, 0.0, 0.0)
    companion.send_state(MissionState(7, 4, 2, 0, 0, True, False, False, far, far))
    companion.send_detections(MissionDetections(0, -1, 240))
    assert forwarder.received() == []
    assert [record.message.partition(": a value")[0] for record in caplog.records] == [
        "not sent: state",
        "not sent: detections",
    ]


async def test_nothing_is_sent_or_raised_while_nothing_is_connected(silent):
    companion, forwarder = silent
    companion.send_state(STATE)
    companion.send_text("too early")
    companion.announce(SYSTEM)
    companion.send_state(STATE)
    companion.beat()
    assert (companion.sent, forwarder.received()) == (0, [])
    await companion.close()
    companion.send_state(STATE)
    companion.beat()
    await companion.close()
    assert companion.sent == 0


async def test_a_socket_that_fails_does_no_harm(pair):
    companion, forwarder = pair

    class Broken:
        def sendto(self, data, peer):
            raise OSError("no buffer space")

        def recvfrom(self, size):
            raise ConnectionRefusedError("port unreachable")

        def close(self):
            pass

    companion._port.close()
    companion._port = Broken()
    companion.send_state(STATE)
    companion.beat()
    assert (companion.sent, forwarder.received()) == (0, [])


async def test_an_error_at_a_beat_ends_the_reports_and_not_the_loop(silent, caplog):
    companion, _ = silent
    failed = asyncio.Event()

    def fail():
        failed.set()
        raise RuntimeError("a fault of ours")

    companion.beat = fail
    companion.announce(SYSTEM)
    await failed.wait()
    await companion.close()
    assert [record.message for record in caplog.records] == [
        "the mission is not reported any more: RuntimeError('a fault of ours')"
    ]


def test_the_companion_s_texts_are_not_taken_for_the_vehicle_s():
    feed = TelemetryFeed()
    for words in ("mission: red.turning", "\x1bPreflight Fail: no heading\n"):
        feed._on_text(type("Text", (), {"text": words}), None)
    assert feed.recent_texts() == "; the vehicle says: Preflight Fail: no heading"


def test_a_vehicle_s_bytes_that_are_no_text_are_not_printed(capfd):
    assert _log(0, b"MAVLink: emergency: \x93\x1b", None, 0, None)
    assert capfd.readouterr() == ("", "")
