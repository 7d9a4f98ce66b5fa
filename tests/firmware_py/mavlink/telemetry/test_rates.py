"""The streams and their rates, compared with those measured from PX4 v1.17."""

from collections import Counter

import pytest

from firmware_py.setpoints import TrajectorySetpoint
from framerunner.wire.dialect import mavlink

SECONDS = 30.0

# Hz on 14540 and 14550, armed and holding; PX4's intended rates. 0: not there.
PX4_HZ = {
    "ALTITUDE": (10, 1),
    "ATTITUDE": (100, 50),
    "ATTITUDE_QUATERNION": (50, 50),
    "ATTITUDE_TARGET": (10, 50),
    "BATTERY_STATUS": (0.5, 0.5),
    "CURRENT_MODE": (0.5, 0.5),
    "DISTANCE_SENSOR": (10, 0.5),
    "ESTIMATOR_STATUS": (1, 0.5),
    "EXTENDED_SYS_STATE": (5, 1),
    "GLOBAL_POSITION_INT": (50, 50),
    "GNSS_INTEGRITY": (1, 1),
    "GPS_RAW_INT": (8, 5),
    "HEARTBEAT": (1, 1),
    "HIGHRES_IMU": (50, 0),
    "HOME_POSITION": (0.5, 0.5),
    "LINK_NODE_STATUS": (1, 1),
    "LOCAL_POSITION_NED": (30, 50),
    "MISSION_CURRENT": (1, 1),
    "ODOMETRY": (30, 0),
    "OPEN_DRONE_ID_LOCATION": (1, 1),
    "OPEN_DRONE_ID_SYSTEM": (1, 1),
    "PING": (1, 0.1),
    "POSITION_TARGET_GLOBAL_INT": (10, 1),
    "POSITION_TARGET_LOCAL_NED": (10, 50),
    "SCALED_PRESSURE": (1, 1),
    "SERVO_OUTPUT_RAW": (10, 50),
    "SYSTEM_TIME": (1, 0),
    "SYS_STATUS": (5, 1),
    "TIMESYNC": (10, 0),
    "TIME_ESTIMATE_TO_TARGET": (0.5, 0.5),
    "VFR_HUD": (10, 4),
    "VIBRATION": (0.5, 0.1),
}
ON_CHANGE = {"EVENT", "CURRENT_EVENT_SEQUENCE", "STATUSTEXT", "GPS_GLOBAL_ORIGIN"}
MAVSDK_TELEMETRY_RATES = [2, 24, 26, 29, 30, 31, 32, 33, 74, 105, 115, 132, 141, 147, 242, 245, 331, 375]
NOT_IN_PX4 = [27, 140, 9999]


@pytest.fixture
def holding(autopilot):
    autopilot.status.armed = True
    autopilot.status.setpoint = TrajectorySetpoint(0, position_ned_m=(1.0, 2.0, -3.0))
    return autopilot


def test_names_and_rates_on_both_links_are_px4s(holding, make_peer):
    peer = make_peer(holding)
    # The first update sends everything once; so do changes of home and origin. They are not counted.
    received = peer.advance(SECONDS)
    for place, link in enumerate(("onboard", "ground")):
        counts = Counter(m.get_type() for on, m in received if on == link)
        expected = {name: rates[place] for name, rates in PX4_HZ.items() if rates[place]}
        assert set(counts) - ON_CHANGE == set(expected)
        for name, rate_hz in expected.items():
            count = rate_hz * SECONDS
            assert counts[name] == pytest.approx(count, rel=0.05, abs=0 if count >= 20 else 1), name


def test_disarmed_there_is_no_global_target(autopilot, make_peer):
    autopilot.status.setpoint = TrajectorySetpoint(0, position_ned_m=(1.0, 2.0, -3.0))
    names = {m.get_type() for _, m in make_peer(autopilot).advance(3.0)}
    assert "POSITION_TARGET_GLOBAL_INT" not in names
    assert "POSITION_TARGET_LOCAL_NED" in names


@pytest.mark.parametrize("message_id", MAVSDK_TELEMETRY_RATES)
def test_every_rate_that_mavsdk_sets_is_accepted_and_streamed(holding, make_peer, message_id):
    peer = make_peer(holding)
    assert [m.result for m in peer.ask(peer.long(511, message_id, 50_000))] == [0]
    counts = Counter(m.get_msgId() for link, m in peer.advance(2.0) if link == "onboard")
    assert counts[message_id] == pytest.approx(40, abs=1)


@pytest.mark.parametrize("name", ["RC_CHANNELS", "GPS_STATUS", "ORBIT_EXECUTION_STATUS"])
def test_px4s_silent_streams_are_accepted_and_silent(holding, make_peer, name):
    peer = make_peer(holding)
    message_id = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
    assert [m.result for m in peer.ask(peer.long(511, message_id, 50_000))] == [0]
    assert name not in {m.get_type() for _, m in peer.advance(0.5)}
    assert [m.result for m in peer.ask(peer.long(512, message_id))] == [2]


@pytest.mark.parametrize("message_id", NOT_IN_PX4)
def test_what_px4_has_no_stream_of_fails(peer, message_id):
    assert [m.result for m in peer.ask(peer.long(511, message_id, 50_000))] == [4]


@pytest.mark.parametrize("name", ["PROTOCOL_VERSION", "OPEN_DRONE_ID_BASIC_ID"])
def test_what_is_sent_on_request_can_be_streamed(peer, name):
    message_id = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
    assert name not in {m.get_type() for _, m in peer.advance(2.5)}
    assert [m.get_type() for m in peer.ask(peer.long(512, message_id))] == [name, "COMMAND_ACK"]
    assert [m.result for m in peer.ask(peer.long(511, message_id, 200_000))] == [0]
    assert 4 <= [m.get_type() for _, m in peer.advance(1.0)].count(name) <= 6


def test_the_serial_number_of_remote_id_is_that_of_the_autopilot(peer):
    (identity, _) = peer.ask(peer.long(512, mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_BASIC_ID))
    (version, _) = peer.ask(peer.long(512, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION))
    assert int(bytes(identity.uas_id).rstrip(b"\0"), 16) == version.uid
    assert (identity.id_type, identity.ua_type) == (1, 2)
