from itertools import pairwise
from math import cos, inf, nan, pi, sin
from types import SimpleNamespace

import pytest

from firmware_py.estimation.wind import WindEstimate
from firmware_py.mavlink.node import MavlinkNode
from firmware_py.mavlink.telemetry.profiles import GROUND, ONBOARD
from firmware_py.setpoints import AttitudeSetpoint, TrajectorySetpoint
from firmware_py.status import FlightMode, LandedState, VehicleStatus
from firmware_py.types import FlightRecord, MotorOutput, VehicleState
from framerunner.vehicle.atmosphere import pressure_hpa, temperature_k
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import BatteryState
from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader


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
def test_the_heartbeat_is_px4s(autopilot, peer, status, base_mode, custom_mode, state):
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


def test_sys_status_has_px4s_bits_on_the_ground_and_in_the_air(autopilot, peer):
    """As measured from a PX4 v1.17 simulation without a remote control."""
    status = latest(peer, "SYS_STATUS")
    assert status.onboard_control_sensors_present == 0x0200402F
    assert status.onboard_control_sensors_enabled == 0x0201402F
    autopilot.status.armed = True
    status = latest(peer, "SYS_STATUS")
    assert status.onboard_control_sensors_present == 0x0300402F
    assert status.onboard_control_sensors_enabled == 0x0301402F
    assert status.onboard_control_sensors_health == 0x1320C83F


def test_the_battery_is_in_both_messages(autopilot, peer):
    autopilot.battery.voltage_v, autopilot.battery.current_a = 15.25, 12.5
    autopilot.battery.used_mah, autopilot.battery.remaining = 840.0, 0.554
    short, full = latest(peer, "SYS_STATUS"), latest(peer, "BATTERY_STATUS")
    assert (short.voltage_battery, short.current_battery, short.battery_remaining) == (15250, 1250, 56)
    assert (full.voltages[0], full.voltages[1]) == (15250, 65535)
    assert (full.current_battery, full.current_consumed, full.battery_remaining) == (1250, 840, 55)
    assert (full.type, full.charge_state) == (1, 1)
    autopilot.battery.warning = 3
    short, full = latest(peer, "SYS_STATUS"), latest(peer, "BATTERY_STATUS")
    assert full.charge_state == 3
    assert not short.onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_SENSOR_BATTERY


@pytest.mark.parametrize("value", [nan, inf, -inf, 1e9])
def test_a_battery_that_makes_no_sense_ends_nothing(autopilot, peer, value):
    autopilot.battery = BatteryState(value, value, value, value)
    assert latest(peer, "SYS_STATUS") is not None
    assert latest(peer, "BATTERY_STATUS") is not None


def test_a_flights_times_are_those_of_the_flight_under_way(autopilot, peer):
    autopilot.flight = FlightRecord(armed_us=3_000_000, takeoff_us=5_000_000, number=2)
    request = peer.long(512, mavlink.MAVLINK_MSG_ID_FLIGHT_INFORMATION)
    told = peer.ask(request)[0]
    assert (told.arming_time_utc, told.takeoff_time_utc, told.flight_uuid) == (0, 0, 2)
    autopilot.status.armed = True
    told = peer.ask(request)[0]
    assert (told.arming_time_utc, told.takeoff_time_utc) == (3_000_000, 5_000_000)
    autopilot.flight.landed_us = 9_000_000
    told = peer.ask(request)[0]
    assert (told.takeoff_time_utc, told.landing_time) == (0, 9000)


def test_targets_on_earth_and_of_attitude(autopilot, peer):
    status = autopilot.status
    status.armed, status.setpoint = (
        True,
        TrajectorySetpoint(0, position_ned_m=(100.0, 0.0, -5.0), yaw_rad=0.5),
    )
    place = latest(peer, "POSITION_TARGET_GLOBAL_INT")
    assert (place.coordinate_frame, place.type_mask, place.alt) == (5, 0x9F8, 494.0)
    assert place.lat_int - 473977420 == pytest.approx(8983, abs=20)  # 100 m north
    attitude = latest(peer, "ATTITUDE_TARGET")
    assert attitude.type_mask == 128 | 7
    status.setpoint = AttitudeSetpoint(0, attitude=(1.0, 0.0, 0.0, 0.0), thrust=0.4)
    attitude = latest(peer, "ATTITUDE_TARGET")
    assert attitude.type_mask == 7
    assert attitude.thrust == pytest.approx(0.4)
    assert latest(peer, "POSITION_TARGET_GLOBAL_INT") is None


def test_the_range_to_the_ground_is_along_the_body(autopilot, peer):
    autopilot.state = VehicleState(position_ned_m=(0.0, 0.0, -10.0))
    assert latest(peer, "DISTANCE_SENSOR").current_distance == 1000
    autopilot.state.attitude = (cos(pi / 6), sin(pi / 6), 0.0, 0.0)  # 60 degrees of roll
    assert latest(peer, "DISTANCE_SENSOR").current_distance == 2000
    autopilot.state.attitude = (0.0, 1.0, 0.0, 0.0)  # on its back
    assert latest(peer, "DISTANCE_SENSOR").current_distance == 0
    autopilot.state = VehicleState(position_ned_m=(0.0, 0.0, -200.0))
    assert latest(peer, "DISTANCE_SENSOR").current_distance == 0


def test_a_return_takes_distances_over_speeds(autopilot, peer):
    parameters = autopilot.parameters
    for name, value in (("RTL_RETURN_ALT", 30), ("RTL_DESCEND_ALT", 10), ("RTL_LAND_DELAY", 0)):
        parameters.set(name, value)
    autopilot.state = VehicleState(position_ned_m=(50.0, 0.0, -12.0))
    seconds = 18 / 3.0 + 50 / parameters.value("MPC_XY_CRUISE") + 20 / 1.5 + 10 / 0.7
    assert latest(peer, "TIME_ESTIMATE_TO_TARGET").safe_return == pytest.approx(seconds, abs=1)


def test_remote_identification_has_position_speed_and_emergency(autopilot, peer):
    autopilot.state = VehicleState(velocity_ned_m_s=(0.0, 3.0, -1.0))
    told = latest(peer, "OPEN_DRONE_ID_LOCATION")
    assert (told.status, told.direction, told.speed_horizontal, told.speed_vertical) == (1, 9000, 300, 100)
    assert (told.latitude, told.timestamp) == (473977420, 65535.0)
    autopilot.status.landed_state = LandedState.IN_AIR
    assert latest(peer, "OPEN_DRONE_ID_LOCATION").status == 2
    autopilot.status.armed = autopilot.status.failsafe = True
    assert latest(peer, "OPEN_DRONE_ID_LOCATION").status == 3
    assert latest(peer, "OPEN_DRONE_ID_SYSTEM").operator_latitude == 473977420


def test_motors_are_in_three_more_messages(autopilot, peer, airframe):
    speed = airframe.motor.max_speed_rad_s / 2
    autopilot.output, autopilot.status.armed = MotorOutput((speed,) * 4), True
    autopilot.battery.current_a = 20.0
    (outputs, _) = peer.ask(peer.long(512, mavlink.MAVLINK_MSG_ID_ACTUATOR_OUTPUT_STATUS))
    assert (outputs.active, outputs.actuator[:5]) == (4, [1500.0] * 4 + [0.0])
    (status, _) = peer.ask(peer.long(512, mavlink.MAVLINK_MSG_ID_ESC_STATUS))
    assert list(status.rpm) == [round(speed * 30 / pi)] * 4
    assert list(status.current) == [5.0] * 4
    (info, _) = peer.ask(peer.long(512, mavlink.MAVLINK_MSG_ID_ESC_INFO))
    assert (info.count, info.info) == (4, 15)


def test_no_position_is_sent_before_one_is_known(autopilot, peer):
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
    autopilot.status.setpoint = TrajectorySetpoint(0, velocity_ned_m_s=(1.0, 0.0, -0.5), yaw_rate_rad_s=0.2)
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
    autopilot.state.position_ned_m = (0.0, 0.0, -1.0)
    assert latest(peer, "ESTIMATOR_STATUS").flags == 895


def test_a_state_that_is_not_finite_ends_nothing(autopilot, peer):
    autopilot.state = VehicleState(
        0, (nan,) * 3, (nan,) * 3, (nan,) * 4, nan, nan, nan, (nan,) * 3, (nan,) * 3
    )
    autopilot.place = GeodeticPoint(nan, nan, nan)
    autopilot.output = MotorOutput((nan,) * 4, nan)
    assert latest(peer, "GLOBAL_POSITION_INT").lat == 0


@pytest.mark.parametrize(("place", "name"), [("origin", "GPS_GLOBAL_ORIGIN"), ("home", "HOME_POSITION")])
def test_origin_and_home_are_sent_when_they_change(autopilot, peer, place, name):
    setattr(autopilot.status, place, GeodeticPoint(10.0, 20.0, 30.0))
    told = [(on, m) for on, m in peer.advance(0.1) if m.get_type() == name]
    assert [on for on, _ in told] == ["onboard", "ground"]
    assert told[0][1].latitude == 100000000


def test_the_date_is_zero_until_it_is_set(autopilot, peer, make_peer):
    assert latest(peer, "SYSTEM_TIME").time_unix_usec == 0
    told = make_peer(autopilot, node_options={"boot_unix_us": 1_700_000_000_000_000})
    date = latest(told, "SYSTEM_TIME")
    assert date.time_unix_usec == 1_700_000_000_000_000 + date.time_boot_ms * 1000


def test_standard_atmosphere():
    assert pressure_hpa(0.0) == pytest.approx(1013.25)
    assert pressure_hpa(1000.0) == pytest.approx(898.76, abs=0.05)  # ISO 2533
    assert temperature_k(1000.0) == pytest.approx(281.65)


def test_every_source_names_its_own_message(autopilot, peer):
    autopilot.status.armed = True
    autopilot.status.setpoint = TrajectorySetpoint(0, position_ned_m=(0.0, 0.0, -1.0))
    autopilot.wind = SimpleNamespace(estimate=WindEstimate((2.0, -1.0), 0.3, 2.2))
    peer.send(mavlink.MAVLink_rc_channels_override_message(1, 1, *[1500] * 8))
    made = {
        message_id: source().get_msgId()
        for service in peer.node.services
        for message_id, source in service.sources.items()
        if message_id != mavlink.MAVLINK_MSG_ID_OPTICAL_FLOW_RAD  # the vehicle has no such sensor
    }
    assert len(made) > 35
    assert all(message_id == made_id for message_id, made_id in made.items())


@pytest.mark.parametrize(("system", "heard"), [(1, True), (2, False)])
def test_the_origin_can_be_set(autopilot, peer, system, heard):
    peer.send(mavlink.MAVLink_set_gps_global_origin_message(system, 473977420, 85455940, 488000))
    assert bool(autopilot.calls) == heard
    if heard:
        assert autopilot.calls[0][1].altitude_m == 488.0
