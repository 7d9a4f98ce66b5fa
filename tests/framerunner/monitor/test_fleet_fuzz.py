"""The fleet survives any messages and sends finite JSON."""

import asyncio
import json
import random
import struct

import pytest
from pydantic import TypeAdapter
from pymavlink.generator.mavcrc import x25crc

from framerunner.monitor.fleet import MonitoredFleet
from framerunner.monitor.live_messages import LiveMessage
from framerunner.wire.dialect import mavlink
from scenarios.loader import load_scenario
from tests.framerunner.monitor.simulated_link import SimulatedLink, all_finite, equipment

CLASSES = [mavlink.mavlink_map[number] for number in sorted(mavlink.mavlink_map)]
USED = [
    mavlink.mavlink_map[number] for number in (0, 1, 2, 30, 31, 32, 77, 147, 245, 253, 269, 385)
]  # what the fleet looks at
SYSTEMS = (0, 1, 1, 1, 2, 3, 250, 255)
COMPONENTS = (0, 1, 1, 1, 100, 105, 190, 191, 191, 255)
NASTY = [
    struct.pack("<f", value)
    for value in (float("nan"), float("inf"), float("-inf"), 3e38, -3e38, 1e-45, 0.0, 1.0)
]


def packet(kind, payload, system, component, sequence):
    head = struct.pack("<BBBBBB", len(payload), 0, 0, sequence % 256, system, component)
    body = head + struct.pack("<I", kind.id)[:3] + payload
    crc = x25crc(body)
    crc.accumulate(bytes([kind.crc_extra]))
    return b"\xfd" + body + struct.pack("<H", crc.crc)


def payload(kind, chance):
    size = kind.unpacker.size
    style = chance.random()
    if style < 0.3:
        return bytes(size)
    if style < 0.6:
        return (b"".join(chance.choices(NASTY, k=size // 4 + 1)))[:size]
    if style < 0.7:
        return b"\xff" * size
    data = bytearray(chance.randbytes(size))
    if kind.id == 385:  # TUNNEL: let it look like one of ours
        data[0:2] = struct.pack("<H", chance.choice((0x8F10, 0x8F11, 0x8F12, 0x8F13)))
        data[4] = chance.choice((0, 10, 58, 87, 128, 255))
        data[5] = chance.choice((1, 1, 1, 2))
    return bytes(data)


def autopilots_heartbeat(system):
    body = struct.pack("<IBBBBB", 3 << 16, 2, 12, 81, 4, 3)
    return packet(mavlink.mavlink_map[0], body, system, 1, 0)


def parsed(data):
    parser = mavlink.MAVLink(None)
    parser.robust_parsing = True
    return parser.parse_buffer(data) or []


MESSAGE = TypeAdapter(LiveMessage)  # what the pages' scripts are checked with


@pytest.mark.parametrize("seed", range(4))
async def test_no_sequence_of_messages_causes_a_fault(seed):
    chance = random.Random(seed)
    scenario = load_scenario("test-case-1") if seed % 2 else None
    fleet = MonitoredFleet(equipment(SimulatedLink(), scenario))
    told = []
    fleet.subscribe(told.append)
    fleet._take([message for system in (1, 2) for message in parsed(autopilots_heartbeat(system))])
    assert fleet.drone_ids() == [1, 2]
    for round_number in range(60):
        batch = b"".join(
            packet(kind, payload(kind, chance), chance.choice(SYSTEMS), chance.choice(COMPONENTS), number)
            for number, kind in enumerate(chance.choices(CLASSES, k=40) + chance.choices(USED, k=60))
        )
        messages = parsed(batch)
        assert len(messages) > 80
        fleet._take(messages)
        for vehicle in fleet._vehicles.values():
            vehicle.tick(asyncio.get_running_loop().time() + round_number)
        everything = [fleet.pose_message(), fleet.status_message(), *fleet.welcome(), *told]
        assert all_finite(everything)
        json.dumps(everything, allow_nan=False)
        for message in everything:
            MESSAGE.validate_json(json.dumps(message), extra="forbid")
        told.clear()
    assert fleet.faults == 0
    for vehicle in fleet._vehicles.values():
        vehicle.close()


async def test_too_many_drones_are_reported_once():
    fleet = MonitoredFleet(equipment(SimulatedLink()))
    told = []
    fleet.subscribe(told.append)
    for _ in range(3):
        for system in range(1, 200):
            fleet._take(parsed(autopilots_heartbeat(system)))
    assert fleet.drone_ids() == list(range(1, 17))
    texts = [message["text"] for message in told]
    assert texts.count("more than 16 drones; the others are not shown") == 1


async def test_ground_stations_cameras_and_companions_are_not_drones():
    fleet = MonitoredFleet(equipment(SimulatedLink()))
    for kind, autopilot, system, component in (
        (6, 8, 255, 190),
        (6, 12, 5, 1),
        (2, 8, 5, 1),
        (30, 8, 1, 100),
        (18, 8, 1, 191),
        (2, 12, 250, 1),
        (2, 12, 0, 1),
        (2, 12, 5, 2),
    ):
        body = struct.pack("<IBBBBB", 0, kind, autopilot, 81, 4, 3)
        fleet._take(parsed(packet(mavlink.mavlink_map[0], body, system, component, 0)))
    assert fleet.drone_ids() == []


async def test_a_watcher_that_fails_does_not_affect_the_others():
    fleet = MonitoredFleet(equipment(SimulatedLink()))
    told = []

    def fail(_message):
        raise ValueError("no")

    fleet.subscribe(fail)
    unsubscribe = fleet.subscribe(told.append)
    fleet.notice(1, "info", "one")
    unsubscribe()
    unsubscribe()
    fleet.notice(1, "info", "two")
    assert [message["text"] for message in told] == ["one"]
    assert fleet.faults == 2


async def test_texts_of_a_drone_are_limited_to_twenty_a_second():
    fleet = MonitoredFleet(equipment(SimulatedLink()))
    told = []
    fleet.subscribe(told.append)
    fleet._take(parsed(autopilots_heartbeat(1)))
    text = mavlink.MAVLink_statustext_message(3, b"loud", 0, 0).pack(mavlink.MAVLink(None, 1, 1))
    fleet._take(parsed(bytes(text) * 500))
    assert sum(message["kind"] == "text" for message in told) == 20
