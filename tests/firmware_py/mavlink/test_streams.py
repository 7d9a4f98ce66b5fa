from itertools import pairwise
from math import nan, pi

import pytest

from firmware_py.mavlink import GROUND, ONBOARD, MavlinkNode
from firmware_py.mavlink.dialect import mavlink
from firmware_py.mavlink.framing import PacketReader
from firmware_py.mavlink.sensing import pressure_hpa, temperature_k, to_body
from firmware_py.mavlink.streams import SOURCES
from firmware_py.status import FlightMode, LandedState, VehicleStatus
from firmware_py.types import GeodeticPoint, MotorOutput, Setpoint, VehicleState


def latest(peer, name, link="onboard"):
    """The last message of that name in two and a half seconds of streams."""
    found = [m for on, m in peer.advance(2.5) if on == link and m.get_type() == name]
    return found[-1] if found else None


def test_the_first_update_sends_a_heartbeat_on_every_link_unheard(autopilot):
    node = MavlinkNode(autopilot, [ONBOARD, GROUND])
    node.update(0)
    sent = {"onboard": b"", "ground": b""}
    for link, data in node.take_output():
        sent[link] += data
    for data in sent.values():
        assert "HEARTBEAT" in {message.get_type() for message in PacketReader().feed(data)}


def test_sequence_numbers_are_each_links_own_without_gaps(peer):
    received = peer.advance(3.0)
    for name in ("onboard", "ground"):
        sequence = [message.get_seq() for link, message in received if link == name]
        assert all((after - before) % 256 == 1 for before, after in pairwise(sequence))


def test_datagrams_hold_whole_packets_below_the_mtu(peer):
    for _ in range(300):
        peer.time_us += 4000
        peer.node.update(peer.time_us)
    for _, data in peer.node.take_output():
        assert data[0] == 0xFD
        assert len(data) <= 1400


@pytest.mark.parametrize(
    ("status", "base_mode", "custom_mode", "state"),
    [
        (VehicleStatus(), 29, 0x03040000, 0),
        (VehicleStatus(ready=True), 29, 0x03040000, 3),
        (VehicleStatus(armed=True, ready=True), 157, 0x03040000, 4),
        (VehicleStatus(armed=True, mode=FlightMode.TAKEOFF), 157, 0x02040000, 4),
        (VehicleStatus(armed=True, mode=FlightMode.OFFBOARD), 145, 0x00060000, 4),
        (VehicleStatus(mode=FlightMode.OFFBOARD), 17, 0x00060000, 0),
        (VehicleStatus(armed=True, mode=FlightMode.LAND, failsafe=True), 157, 0x06040000, 5),
    ],
)
def test_heartbeat_says_what_px4_says(autopilot, peer, status, base_mode, custom_mode, state):
    autopilot.status = status
    beat = latest(peer, "HEARTBEAT")
    assert (beat.type, beat.autopilot) == (2, 12)
    assert (beat.base_mode, beat.custom_mode, beat.system_status) == (base_mode, custom_mode, state)


def test_health_bits_that_mavsdk_waits_for(autopilot, peer):
    status = latest(peer, "SYS_STATUS")
    sensors = 0x1 | 0x2 | 0x4 | 0x20
    assert status.onboard_control_sensors_present & sensors == sensors
    assert status.onboard_control_sensors_health & (sensors | 0x10000000) == sensors | 0x10000000
    autopilot.status = VehicleStatus()  # no position, not ready
    status = latest(peer, "SYS_STATUS")
    assert status.onboard_control_sensors_health & (0x20 | 0x10000000) == 0
    assert status.onboard_control_sensors_health & 0x7 == 0x7


def test_nothing_is_claimed_before_a_position_is_known(autopilot, peer):
    autopilot.status, autopilot.place = VehicleStatus(), None
    names = {message.get_type() for _, message in peer.advance(2.5)}
    assert not names & {"GLOBAL_POSITION_INT", "LOCAL_POSITION_NED", "HOME_POSITION", "ODOMETRY", "VFR_HUD"}
    assert latest(peer, "GPS_RAW_INT").fix_type == mavlink.GPS_FIX_TYPE_NO_FIX


def test_motion_is_packed_in_mavlinks_units(autopilot, peer):
    autopilot.state = VehicleState(
        time_us=1_500_000,
        position_ned_m=(1.0, 2.0, -3.0),
        velocity_ned_m_s=(0.3, 0.4, -0.5),
        yaw_rad=-pi / 2,
        angular_rate_frd_rad_s=(0.1, 0.2, 0.3),
    )
    autopilot.place = GeodeticPoint(47.4, 8.5, 492.0)
    place = latest(peer, "GLOBAL_POSITION_INT")
    assert (place.lat, place.lon, place.alt, place.relative_alt) == (474000000, 85000000, 492000, 3000)
    assert (place.vx, place.vy, place.vz, place.hdg) == (30, 40, -50, 27000)
    hud = latest(peer, "VFR_HUD")
    assert (hud.heading, hud.climb) == (270, pytest.approx(0.5))
    assert hud.groundspeed == pytest.approx(0.5)
    local = latest(peer, "LOCAL_POSITION_NED")
    assert (local.time_boot_ms, local.x, local.y, local.z) == (1500, 1.0, 2.0, -3.0)
    assert latest(peer, "ATTITUDE").yaw == pytest.approx(-pi / 2)
    heights = latest(peer, "ALTITUDE")
    assert (heights.altitude_amsl, heights.altitude_local, heights.altitude_relative) == (492.0, 3.0, 3.0)


def test_the_target_is_masked_where_nothing_is_controlled(autopilot, peer):
    autopilot.status.setpoint = Setpoint(0, velocity_ned_m_s=(1.0, 0.0, -0.5), yaw_rate_rad_s=0.2)
    target = latest(peer, "POSITION_TARGET_LOCAL_NED")
    assert target.type_mask == 0x5C7
    assert (target.vx, target.vz) == (1.0, -0.5)
    assert target.yaw_rate == pytest.approx(0.2)


def test_motors_as_pulses(autopilot, peer, airframe):
    autopilot.output = MotorOutput((0.0, airframe.motor.max_speed_rad_s / 2, 0.0, 0.0))
    pulses = latest(peer, "SERVO_OUTPUT_RAW")
    assert (pulses.servo1_raw, pulses.servo2_raw, pulses.servo5_raw) == (900, 900, 0)
    autopilot.status.armed = True
    pulses = latest(peer, "SERVO_OUTPUT_RAW")
    assert (pulses.servo1_raw, pulses.servo2_raw, pulses.servo5_raw) == (1000, 1500, 0)


def test_landed_state_and_modes(autopilot, peer):
    autopilot.status.landed_state = LandedState.LANDING
    autopilot.status.mode, autopilot.status.intended_mode = FlightMode.LAND, FlightMode.OFFBOARD
    assert latest(peer, "EXTENDED_SYS_STATE").landed_state == 4
    mode = latest(peer, "CURRENT_MODE")
    assert (mode.standard_mode, mode.custom_mode, mode.intended_custom_mode) == (7, 0x06040000, 0x00060000)


def test_estimator_flags_are_px4s(autopilot, peer):
    assert latest(peer, "ESTIMATOR_STATUS").flags == 959
    autopilot.status.landed_state = LandedState.IN_AIR
    assert latest(peer, "ESTIMATOR_STATUS").flags == 895


def test_a_state_that_is_not_finite_ends_nothing(autopilot, peer):
    autopilot.state = VehicleState(
        0, (nan,) * 3, (nan,) * 3, (nan,) * 4, nan, nan, nan, (nan,) * 3, (nan,) * 3
    )
    autopilot.place = GeodeticPoint(nan, nan, nan)
    autopilot.output = MotorOutput((nan,) * 4, nan)
    assert latest(peer, "GLOBAL_POSITION_INT").lat == 0


@pytest.mark.parametrize(("place", "name"), [("origin", "GPS_GLOBAL_ORIGIN"), ("home", "HOME_POSITION")])
def test_origin_and_home_are_told_when_they_change(autopilot, peer, place, name):
    setattr(autopilot.status, place, GeodeticPoint(10.0, 20.0, 30.0))
    told = [(on, m) for on, m in peer.advance(0.1) if m.get_type() == name]
    assert [on for on, _ in told] == ["onboard", "ground"]
    assert told[0][1].latitude == 100000000


def test_date_only_when_told(autopilot, peer, make_peer):
    assert latest(peer, "SYSTEM_TIME").time_unix_usec == 0
    told = make_peer(autopilot, node_options={"boot_unix_us": 1_700_000_000_000_000})
    date = latest(told, "SYSTEM_TIME")
    assert date.time_unix_usec == 1_700_000_000_000_000 + date.time_boot_ms * 1000


def test_standard_atmosphere():
    assert pressure_hpa(0.0) == pytest.approx(1013.25)
    assert pressure_hpa(1000.0) == pytest.approx(898.76, abs=0.05)  # ISO 2533
    assert temperature_k(1000.0) == pytest.approx(281.65)


def test_field_turns_into_the_body():
    quarter_right = (2**-0.5, 0.0, 0.0, 2**-0.5)  # looking east, north is on the left
    assert to_body((1.0, 0.0, 0.5), quarter_right) == pytest.approx((0.0, -1.0, 0.5))


def test_every_source_names_its_own_message(autopilot):
    autopilot.status.armed = True
    autopilot.status.setpoint = Setpoint(0, position_ned_m=(0.0, 0.0, -1.0))
    for message_id, source in SOURCES.items():
        assert source(autopilot, 1_000_000).get_msgId() == message_id
