"""The battery that PX4 gets, and what it says about failures."""

import socket
import time

import pytest
from pymavlink.dialects.v20 import common as mavlink

from scenarios.faults.declaration import parse_fault
from scenarios.loader import load_scenario
from sitl.px4.side_link import CAMERA_PORT, PERIOD_US, SideLink
from sitl.px4.simulation import Px4Simulation
from sitl.px4.simulator_messages import ActuatorControls
from sitl.px4.words import FailsafeWords
from sitl.server_settings import ServerSettings
from tests.processes import free_instance

LAND = 0x06040000


class Flight:
    """A drone in the air by a fake PX4: armed from the start, its motors at half speed."""

    def __init__(self, tmp_path, *faults, sensors="mocap"):
        instance = free_instance()
        scenario = load_scenario("test-case-1").model_copy(
            update={"sensors": sensors, "faults": tuple(map(parse_fault, faults))}
        )
        self.simulation = Px4Simulation(scenario)
        self.output = tmp_path / "px4.log"
        self.px4 = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.px4.bind(("127.0.0.1", CAMERA_PORT + instance))
        self.px4.settimeout(5.0)
        self.link = SideLink(ServerSettings(instance=instance), scenario.camera, self.output)
        self.sender = mavlink.MAVLink(None, srcSystem=instance + 1, srcComponent=1)
        self.others = {}

    def fly(self, seconds):
        simulation = self.simulation
        for _ in range(round(seconds * 250)):
            time_us = simulation.time_us
            simulation.sense()
            simulation.move(ActuatorControls(time_us, (0.5,) * 16, armed=True))
            if time_us % PERIOD_US == 0:
                self.link.step(simulation)

    def battery(self):
        """The last one that has come."""
        self.px4.setblocking(False)
        found = None
        while True:
            try:
                data, self.peer = self.px4.recvfrom(2048)
            except BlockingIOError:
                return found
            (message,) = mavlink.MAVLink(None).parse_buffer(data)
            self.others[message.get_type()] = message
            if message.get_type() == "BATTERY_STATUS":
                found = message

    def heartbeat(self, custom_mode, status):
        self.send(self.sender.heartbeat_encode(2, 12, 157, custom_mode, status))

    def send(self, message):
        self.px4.sendto(message.pack(self.sender), self.peer)
        time.sleep(0.05)

    def close(self):
        self.link.close()
        self.px4.close()


def test_px4_gets_the_battery_as_its_monitor_measures_it(tmp_path):
    flight = Flight(tmp_path, "battery sag 0.3 at 1 s", "battery_monitor off at 2 s")
    flight.fly(0.9)
    full = flight.battery()
    assert (full.get_srcComponent(), full.charge_state) == (180, 1)
    assert full.battery_remaining > 80
    cells = [each for each in full.voltages if each < 65535]
    assert len(cells) == 3
    assert 3300 < min(cells) == max(cells) < 4300  # under load
    assert full.current_battery > 100
    flight.fly(0.9)
    sagging = flight.battery()
    assert (sagging.battery_remaining, sagging.charge_state) == (0, 4)
    assert sagging.voltages[0] < 0.75 * full.voltages[0]
    flight.fly(0.3)
    flight.battery()
    flight.fly(0.5)
    assert flight.battery() is None
    flight.close()


def test_what_px4_prints_and_its_mode_become_the_failsafes_of_the_flight(tmp_path):
    flight = Flight(tmp_path, "battery sag 0.3 at 1 s")
    flight.output.write_text("WARN  [health_and_arming_checks] Preflight Fail: before arming\n")
    flight.link.step(flight.simulation)
    flight.fly(1.2)
    flight.battery()
    with flight.output.open("a") as output:
        output.write("ERROR [mavlink] something of its links\nWARN  [commander] \x1b[31mEmergency ")
    flight.fly(0.2)
    with flight.output.open("a") as output:
        output.write("battery level\x1b[0m\t\nWARN  [failsafe] Failsafe activated\t\n")
    flight.fly(0.2)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
        genuine, flight.px4 = flight.px4, stranger
        flight.heartbeat(0, mavlink.MAV_STATE_CRITICAL)
        flight.px4 = genuine
    flight.heartbeat(LAND, mavlink.MAV_STATE_CRITICAL)
    flight.fly(0.2)
    facts = flight.simulation.fault_facts()
    (failsafe,) = facts.failsafes
    assert failsafe.text == "Emergency battery level; Failsafe activated: LAND"
    assert 1.4e6 < failsafe.time_us < 1.6e6
    assert facts.autopilot == "PX4"
    flight.close()


@pytest.mark.parametrize(("sensors", "is_told"), [("mocap", True), ("flow", False), ("outdoor", False)])
def test_a_px4_with_a_compass_is_not_told_its_place(tmp_path, sensors, is_told):
    """PX4 would then expect another magnetic field, and refuse to arm: heading estimate not stable."""
    flight = Flight(tmp_path, sensors=sensors)
    flight.link.step(flight.simulation)
    flight.battery()
    assert ("SET_GPS_GLOBAL_ORIGIN" in flight.others) == is_told
    flight.close()


def test_a_px4_whose_output_is_unknown_shows_the_mode_alone():
    words = FailsafeWords()
    words.set_armed(True)
    words.heartbeat(1_000_000, "POSCTL", critical=False)
    for time_us in (2_000_000, 3_000_000):
        words.heartbeat(time_us, "LOITER", critical=True)
    words.heartbeat(7_000_000, "LAND", critical=True)
    assert words.failsafes == [(2_000_000, "failsafe: LOITER"), (7_000_000, "failsafe: LAND")]
    words.set_armed(False)
    words.heartbeat(8_000_000, "POSCTL", critical=True)
    assert len(words.failsafes) == 2
    words.set_armed(True)
    assert words.failsafes == []


def test_ground_stations_find_the_video_and_px4_learns_its_place(tmp_path):
    flight = Flight(tmp_path)
    flight.link.step(flight.simulation)
    flight.battery()
    assert flight.others["HEARTBEAT"].get_srcComponent() == 100
    origin = flight.others["SET_GPS_GLOBAL_ORIGIN"]
    assert origin.latitude == pytest.approx(flight.simulation.scenario.origin.latitude_deg * 1e7, abs=1)
    assert (origin.altitude, origin.target_system) == (0, flight.sender.srcSystem)
    ground = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    system_id, peer = flight.sender.srcSystem, flight.sender
    for component, message_id in ((100, 269), (100, 259), (1, 269)):
        flight.others.clear()
        flight.sender = ground
        flight.send(ground.command_long_encode(system_id, component, 512, 0, message_id, 0, 0, 0, 0, 0, 0))
        flight.sender = peer
        flight.link.step(flight.simulation)
        flight.battery()
        answer = flight.others.get("COMMAND_ACK")
        stream = flight.others.get("VIDEO_STREAM_INFORMATION")
        if (component, message_id) == (100, 269):
            assert (answer.result, answer.target_system) == (0, 255)
            assert stream.uri.rstrip("\0").endswith("/video")
        elif component == 100:
            assert (answer.result, stream) == (3, None)
        else:
            assert (answer, stream) == (None, None)
    flight.close()
