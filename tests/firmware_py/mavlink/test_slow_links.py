"""A slow serial line: streams are stretched to fit, heartbeats and answers are sent."""

from dataclasses import replace

import pytest

from firmware_py.mavlink.telemetry.profiles import NORMAL, ONBOARD
from framerunner.wire.dialect import mavlink

BYTES_S = 2880.0  # half of 57600 baud


@pytest.fixture
def serial_peer(autopilot, make_peer):
    return make_peer(autopilot, links=(replace(ONBOARD, name="serial", bytes_s=BYTES_S),))


def size(received):
    return sum(len(message.get_msgbuf()) for _, message in received)


def test_streams_fit_the_line(serial_peer):
    serial_peer.advance(5.0)
    received = serial_peer.advance(20.0)
    assert 0.7 * BYTES_S < size(received) / 20.0 < 1.05 * BYTES_S


def test_heartbeats_keep_their_rate(serial_peer):
    received = serial_peer.advance(20.0)
    beats = [m for _, m in received if m.get_type() == "HEARTBEAT"]
    assert 19 <= len(beats) <= 21


def test_all_streams_slow_down_alike(serial_peer):
    serial_peer.advance(5.0)
    received = [m.get_type() for _, m in serial_peer.advance(40.0)]
    assert received.count("ATTITUDE") == pytest.approx(2 * received.count("ATTITUDE_QUATERNION"), rel=0.15)


def test_requested_streams_fit_too(serial_peer):
    serial_peer.send(serial_peer.long(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, 30, 1000), "serial")
    serial_peer.advance(5.0)
    assert size(serial_peer.advance(10.0)) / 10.0 < 1.1 * BYTES_S


def test_a_parameter_list_waits_for_the_line(serial_peer):
    serial_peer.advance(3.0)
    serial_peer.send(mavlink.MAVLink_param_request_list_message(1, 1), "serial")
    spent = []
    for _ in range(30):
        spent.append(size(serial_peer.advance(1.0)))
    assert max(spent[1:]) < 2.0 * BYTES_S  # the line does twice what streams may take
    count = len(serial_peer.autopilot.parameters)
    assert sum(spent) > 30 * min(count, 200)


def test_a_radio_gets_normal_streams_in_full(autopilot, make_peer):
    peer = make_peer(autopilot, links=(replace(NORMAL, name="serial", bytes_s=BYTES_S),))
    peer.advance(5.0)
    received = [m.get_type() for _, m in peer.advance(10.0)]
    assert received.count("ATTITUDE") == pytest.approx(150, abs=3)
