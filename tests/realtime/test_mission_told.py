"""What a ground station hears of a mission, while the app flies it and until it is judged."""

from __future__ import annotations

import json
import threading
import time
from dataclasses import dataclass

import pytest
from pymavlink import mavutil

from framerunner.wire.mission_tunnel import DocumentAssembler, DocumentKind, decode_detections, decode_state
from offboard.mission import load_mission, mermaid
from tests.processes import bound, free_instance, program

mavlink = mavutil.mavlink
pytestmark = [pytest.mark.realtime, pytest.mark.alone]

GROUND_PORT = 14550  # where `fly` has its simulator look for ground stations
LATE_US = 300_000

MISSION = """\
name: up_and_down
description: Up and down again
initial: rise
states:
  rise:
    enter:
      - hover
      - goal_m = (imu.x, imu.y, 1)
    during:
      - fly_to_goal
    transitions:
      - when: distance_to_goal_m < 0.3
        to: wait
  wait:
    enter:
      - hover
    transitions:
      - when: seconds_in_state > 1
        to: down
  down:
    enter:
      - land
    final: true
"""


@dataclass(frozen=True)
class Told:
    """A message of component 191, and the vehicle's time and the wall's when it came."""

    message: object
    vehicle_us: int
    wall_s: float


class Station(threading.Thread):
    """A ground station that sends heartbeats, so that the vehicle forwards to it, and keeps what it hears."""

    def __init__(self):
        super().__init__(daemon=True)
        self._link = mavutil.mavlink_connection(
            f"udpin:127.0.0.1:{GROUND_PORT}", source_system=255, source_component=190
        )
        self._halt = threading.Event()
        self._vehicle_us = 0
        self.told: list[Told] = []

    def run(self):
        while not self._halt.is_set():
            message = self._link.recv_match(blocking=True, timeout=0.1)
            if message is None:
                continue
            if message.get_srcComponent() == 191:
                self.told.append(Told(message, self._vehicle_us, time.monotonic()))
            elif message.get_type() == "ATTITUDE":
                self._vehicle_us = 1000 * message.time_boot_ms
            elif message.get_type() == "HEARTBEAT":
                self._link.mav.heartbeat_send(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0)

    def stop(self):
        self._halt.set()
        self.join()
        self._link.close()

    def of(self, kind):
        return [told for told in self.told if told.message.get_type() == kind]

    def payloads(self, payload_type):
        return [
            (bytes(told.message.payload[: told.message.payload_length]), told.vehicle_us)
            for told in self.of("TUNNEL")
            if told.message.payload_type == payload_type
        ]


@pytest.fixture
def station():
    try:
        bound(GROUND_PORT).close()
    except OSError:
        pytest.skip(f"somebody else is the ground station on port {GROUND_PORT}")
    station = Station()
    station.start()
    yield station
    station.stop()


def test_a_ground_station_hears_the_mission_from_its_first_state_to_the_verdict(tmp_path, station):
    path = tmp_path / "up_and_down.yaml"
    path.write_text(MISSION, encoding="utf-8")
    mission = load_mission(path)
    instance = free_instance()
    with program(
        tmp_path, "fly", "test-case-1", "--mission", str(path), "--instance", str(instance)
    ) as flight:
        assert flight.process.wait(90.0) == 1, flight.err  # flown, but no gate was crossed
        assert "Traceback" not in flight.err and "warning" not in flight.err
    station.stop()
    (folder,) = (tmp_path / "runs").iterdir()
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))

    assert {told.message.get_srcSystem() for told in station.told} == {instance + 1}
    beats = station.of("HEARTBEAT")
    assert {beat.message.type for beat in beats} == {mavlink.MAV_TYPE_ONBOARD_CONTROLLER}
    # One a second; vehicle time stands until the flight begins.
    before = [beat.wall_s for beat in beats if beat.vehicle_us == beats[0].vehicle_us]
    assert len(before) - 1 <= before[-1] - before[0] + 1.5
    flown = [beat.vehicle_us for beat in beats[len(before) :]]
    assert abs(len(flown) - 1 - (flown[-1] - flown[0]) / 1e6) <= 1.5
    assert [text.message.text for text in station.of("STATUSTEXT")] == [
        "mission: rise",
        "mission: wait",
        "mission: down",
    ]

    assembler = DocumentAssembler()
    documents = [document for payload, _ in station.payloads(0x8F12) if (document := assembler.take(payload))]
    told = {kind: [document for document in documents if document.kind == kind] for kind in DocumentKind}
    (plan,) = told[DocumentKind.MISSION]
    assert plan.content == {
        "name": "up_and_down",
        "description": "Up and down again",
        "scenario": "test-case-1",
        "states": ["rise", "wait", "down"],
        "mermaid": mermaid(mission),
        "source": MISSION,
    }
    assert [document.content for document in told[DocumentKind.RESULT]] == [result]

    states = [(decode_state(payload), heard_us) for payload, heard_us in station.payloads(0x8F10)]
    assert {state.mission_crc for state, _ in states} == {plan.crc}
    first_told = {}
    for state, heard_us in states:
        first_told.setdefault(state.state_index, (state, heard_us))
    assert [*first_told] == [-1, 0, 1, 2]
    for index in (0, 1, 2):
        state, heard_us = first_told[index]
        assert state.time_us == state.entered_us and state.transitions == index
        assert heard_us - state.time_us < LATE_US  # also where the motors are then started or stopped
    flown = [state for state, _ in states if state.flying]
    assert 0.65 < max(state.pose_arena[2] for state in flown) < 1.1
    assert states[-1][0].finished and not states[-1][0].flying

    (history,) = [document.content for document in told[DocumentKind.HISTORY]][-1:]
    rising, waiting = history["transitions"]
    assert (rising["from"], rising["to"], rising["when"]) == ("rise", "wait", "distance_to_goal_m < 0.3")
    ((name, distance_m),) = rising["values"]
    assert name == "distance_to_goal_m" and 0.2 < distance_m < 0.3
    assert (waiting["from"], waiting["to"]) == ("wait", "down")
    assert waiting["values"] == [["seconds_in_state", pytest.approx(waiting["seconds"])]]
    assert waiting["time_us"] == first_told[2][0].entered_us
    assert waiting["seconds"] == pytest.approx(1.05, abs=0.06)

    images = [decode_detections(payload) for payload, _ in station.payloads(0x8F11)]
    assert {(image.width_px, image.height_px) for image in images} == {(320, 240)}
    seen_s = (images[-1].time_us - images[0].time_us) / 1e6
    assert seen_s > 2.0 and len({image.time_us for image in images}) == len(images) > 5 * seen_s
