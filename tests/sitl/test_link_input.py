"""The processor time that links' input takes of a control tick is bounded, and links take turns."""

import pytest

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.node import MavlinkNode
from firmware_py.mavlink.telemetry.profiles import GROUND, ONBOARD
from framerunner.vehicle.airframe import load_airframe
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.wire.dialect import mavlink
from sitl.link_hub import LinkInput

BEAT = mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3)
TURN_S = 0.0005


class Inlet:
    """A node's input; each turn of a link takes half a millisecond of processor time."""

    def __init__(self):
        autopilot = Autopilot(load_airframe("abejorro"), GeodeticPoint(47.0, 8.0, 400.0))
        self.node = MavlinkNode(autopilot, (ONBOARD, GROUND))
        self.now_s = 0.0
        self._readings = 0
        self.notices = []
        self.input = LinkInput(self.node, self.notices.append, lambda: self.now_s, self.processor_time)

    @property
    def used_s(self):
        return (self._readings + 1) // 2 * TURN_S

    def processor_time(self):
        """Read before and after each turn."""
        self._readings += 1
        return self._readings // 2 * TURN_S

    def pass_time(self, seconds):
        """Advance by ticks of 4 ms; return the maximum that one of them used, in seconds."""
        most_s = 0.0
        for _ in range(round(seconds / 0.004)):
            self.now_s += 0.004
            before_s = self.used_s
            self.input.work()
            most_s = max(most_s, self.used_s - before_s)
        return most_s

    def heard(self, link):
        return self.node._exchange.links[link].traffic.messages_received


@pytest.fixture
def inlet():
    return Inlet()


def packets(count, system=255):
    packer = mavlink.MAVLink(None, system, 190)
    return BEAT.pack(packer) * count


def test_single_packets_are_processed_at_once(inlet):
    inlet.input.take("onboard", packets(3))
    assert inlet.heard("onboard") == 3


def test_a_flood_costs_a_tick_a_quarter_of_its_time(inlet):
    inlet.input.take("onboard", packets(3000))
    assert inlet.used_s <= 0.004 + TURN_S
    before = inlet.heard("onboard")
    assert before <= 40
    assert inlet.pass_time(0.4) <= 0.001 + TURN_S
    assert inlet.used_s <= 0.004 + 0.1 + TURN_S
    assert inlet.heard("onboard") > before + 500
    inlet.pass_time(3.0)
    assert inlet.heard("onboard") == 3000


def test_time_not_used_is_not_saved_up(inlet):
    inlet.pass_time(60.0)
    inlet.input.take("onboard", packets(3000))
    assert inlet.used_s <= 0.004 + TURN_S


def test_a_flooded_link_starves_no_other(inlet):
    inlet.input.take("onboard", packets(3000))
    for count in range(1, 50):
        inlet.input.take("onboard", packets(100))
        inlet.input.take("ground", packets(1, system=254))
        inlet.pass_time(0.004)
        assert inlet.heard("ground") >= count - 1


def test_what_is_dropped_is_reported_but_not_each_time(inlet):
    for _ in range(100):
        inlet.input.take("onboard", bytes(40_000))
    assert len(inlet.notices) == 1
    assert "link onboard" in inlet.notices[0]
    inlet.pass_time(9.9)
    assert len(inlet.notices) == 1
    inlet.pass_time(0.2)
    assert len(inlet.notices) == 2
    inlet.pass_time(30.0)
    assert len(inlet.notices) == 2
    status = inlet.node._exchange.links["onboard"]
    assert status.reader.overflows > 50


def test_a_removed_link_is_skipped(inlet):
    inlet.input.take("ground", packets(3000))
    inlet.node.remove_link("ground")
    inlet.input.take("ground", packets(1))
    inlet.pass_time(0.1)
    inlet.input.take("onboard", packets(1))
    assert inlet.heard("onboard") == 1
