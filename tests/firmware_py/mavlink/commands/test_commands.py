from math import inf, isnan, nan

import pytest

from firmware_py.guidance.orbit import OrbitYaw
from firmware_py.status import CommandResult, FlightMode, VehicleStatus
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.wire.dialect import mavlink
from tests.firmware_py.mavlink.conftest import HOME

ACCEPTED, REJECTED, DENIED, UNSUPPORTED, FAILED = range(5)
ARM, SET_MODE, TAKEOFF, LAND = 400, 176, 22, 21
REQUEST, SET_INTERVAL, GET_INTERVAL = 512, 511, 510


def acks(answers):
    return [(m.command, m.result) for m in answers if m.get_type() == "COMMAND_ACK"]


# command, parameters, acknowledgement (None: silence), what the autopilot was asked for
TABLE = [
    pytest.param(ARM, [1], ACCEPTED, [("arm", False)], id="arm"),
    pytest.param(ARM, [1, 21196], ACCEPTED, [("arm", True)], id="arm-forced"),
    pytest.param(ARM, [0], ACCEPTED, [("disarm", False)], id="disarm"),
    pytest.param(ARM, [0, 21196], ACCEPTED, [("disarm", True)], id="disarm-forced"),
    pytest.param(ARM, [0, 21195], ACCEPTED, [("disarm", False)], id="disarm-wrong-magic"),
    pytest.param(ARM, [0, nan], ACCEPTED, [("disarm", False)], id="disarm-nan-force"),
    pytest.param(ARM, [nan], ACCEPTED, [], id="arm-nan-does-nothing"),
    pytest.param(ARM, [5], None, [], id="arm-5-is-not-answered"),
    pytest.param(ARM, [inf], None, [], id="arm-inf-is-not-answered"),
    pytest.param(ARM, [-1], None, [], id="arm-minus-1-is-not-answered"),
    pytest.param(TAKEOFF, [0, 0, 0, 0, 0, 0, 492], ACCEPTED, [("takeoff", 492.0)], id="takeoff"),
    pytest.param(TAKEOFF, [nan, 0, 0, nan, 0, 0, inf], DENIED, [], id="takeoff-to-infinity"),
    pytest.param(LAND, [nan] * 4, ACCEPTED, [("land",)], id="land"),
    pytest.param(SET_MODE, [1, 4, 3], ACCEPTED, [("set_mode", FlightMode.HOLD)], id="hold"),
    pytest.param(SET_MODE, [129, 6, 0], ACCEPTED, [("set_mode", FlightMode.OFFBOARD)], id="offboard"),
    pytest.param(SET_MODE, [1, 6, nan], ACCEPTED, [("set_mode", FlightMode.OFFBOARD)], id="offboard-nan-sub"),
    pytest.param(SET_MODE, [1, 6, 7], REJECTED, [], id="offboard-with-sub-mode"),
    pytest.param(SET_MODE, [29, 4, 6], ACCEPTED, [("set_mode", FlightMode.LAND)], id="land-mode"),
    pytest.param(SET_MODE, [1, 4, 99], REJECTED, [], id="bad-auto-mode"),
    pytest.param(SET_MODE, [1, 99, 0], REJECTED, [], id="bad-main-mode"),
    pytest.param(SET_MODE, [1, 3, 0], ACCEPTED, [("set_mode", FlightMode.POSITION)], id="position"),
    pytest.param(SET_MODE, [1, 4, 5], ACCEPTED, [("set_mode", FlightMode.RETURN)], id="return"),
    pytest.param(SET_MODE, [0, 4, 3], REJECTED, [], id="no-custom-flag"),
    pytest.param(SET_MODE, [nan, 4, 3], REJECTED, [], id="mode-nan"),
    pytest.param(SET_MODE, [1, 1e30, -1e30], REJECTED, [], id="mode-huge"),
    pytest.param(262, [7], ACCEPTED, [("set_mode", FlightMode.LAND)], id="standard-land"),
    pytest.param(262, [2], ACCEPTED, [("set_mode", FlightMode.ORBIT)], id="standard-orbit"),
    pytest.param(262, [3], REJECTED, [], id="standard-cruise"),
    pytest.param(300, [], DENIED, [], id="mission-start-without-mission"),
    pytest.param(401, [], ACCEPTED, [], id="run-prearm-checks"),
    pytest.param(31999, [], UNSUPPORTED, [], id="unknown"),
    pytest.param(611, [0, 0, 0, 0, 47.4, 8.5, 500], UNSUPPORTED, [], id="origin, as PX4 1.17"),
    pytest.param(2000, [], UNSUPPORTED, [], id="image-start-capture"),
    pytest.param(209, [], UNSUPPORTED, [], id="motor-test"),
    pytest.param(115, [], UNSUPPORTED, [], id="condition-yaw"),
    pytest.param(20, [], ACCEPTED, [("set_mode", FlightMode.RETURN)], id="return-to-launch"),
    pytest.param(178, [1, 7.0, -1], ACCEPTED, [("change_speed", 7.0)], id="change-speed"),
    pytest.param(179, [1], ACCEPTED, [("set_home", None)], id="set-home-here"),
    pytest.param(185, [0], DENIED, [], id="no-termination"),
    pytest.param(185, [1], DENIED, [], id="termination-disarmed"),
    pytest.param(192, [-1, 0, 0, nan], UNSUPPORTED, [], id="reposition-without-mode-change"),
    pytest.param(192, [-1, 3, 0, nan], UNSUPPORTED, [], id="reposition-unknown-flag"),
    pytest.param(197, [], ACCEPTED, [("look_at", None)], id="look-ahead"),
    pytest.param(34, [0.5, 2.0, 0, nan], DENIED, [], id="orbit-too-small"),
    pytest.param(34, [2000.0, 2.0, 0, nan], DENIED, [], id="orbit-too-large"),
    pytest.param(187, [0.5], ACCEPTED, [], id="set-actuator"),
    pytest.param(241, [1], ACCEPTED, [], id="calibrate-gyroscope"),
    pytest.param(241, [], ACCEPTED, [], id="stop-calibrating"),
    pytest.param(241, [0, 0, 0, 1], UNSUPPORTED, [], id="calibrate-remote-control"),
    pytest.param(245, [2], ACCEPTED, [], id="reset-parameters"),
    pytest.param(245, [9], DENIED, [], id="storage-unknown"),
    pytest.param(246, [1], UNSUPPORTED, [], id="reboot"),
    pytest.param(310, [0.5], UNSUPPORTED, [], id="actuator-test"),
    pytest.param(REQUEST, [9999], DENIED, [], id="request-unknown"),
    pytest.param(REQUEST, [259], DENIED, [], id="request-camera-information"),
    pytest.param(REQUEST, [410], DENIED, [], id="request-event"),
    pytest.param(REQUEST, [nan], DENIED, [], id="request-nan"),
    pytest.param(REQUEST, [1e30], DENIED, [], id="request-huge"),
    pytest.param(REQUEST, [-1], DENIED, [], id="request-negative"),
    pytest.param(SET_INTERVAL, [30, 20000], ACCEPTED, [], id="interval"),
    pytest.param(SET_INTERVAL, [30, -1], ACCEPTED, [], id="interval-off"),
    pytest.param(SET_INTERVAL, [9999, 1000], FAILED, [], id="interval-unknown"),
    pytest.param(SET_INTERVAL, [0, 1000], FAILED, [], id="interval-heartbeat"),
    pytest.param(SET_INTERVAL, [30, nan], FAILED, [], id="interval-nan"),
]


@pytest.mark.parametrize(("command", "params", "result", "calls"), TABLE)
@pytest.mark.parametrize("carrier", ["long", "int"])
def test_the_table_of_acknowledgements(autopilot, peer, carrier, command, params, result, calls):
    frame = {} if carrier == "long" else {"frame": mavlink.MAV_FRAME_GLOBAL_INT}
    answers = peer.ask(getattr(peer, carrier)(command, *params, **frame))
    assert acks(answers) == ([] if result is None else [(command, result)])
    assert autopilot.calls == calls


@pytest.mark.parametrize("result", list(CommandResult))
@pytest.mark.parametrize(
    ("command", "params"), [(ARM, [1]), (ARM, [0]), (SET_MODE, [1, 6]), (TAKEOFF, []), (LAND, [])]
)
def test_the_one_ack_is_the_autopilots_answer(autopilot, peer, command, params, result):
    autopilot.result = result
    assert acks(peer.ask(peer.long(command, *params))) == [(command, result)]


def test_the_ack_is_sent_to_the_sender_on_its_link_only(peer):
    peer.send(peer.long(LAND), "ground")
    ((link, ack),) = peer.take()
    assert (link, ack.target_system, ack.target_component) == ("ground", 245, 191)


@pytest.mark.parametrize("target", [(2, 1), (0, 0), (0, 1), (1, 55), (255, 190)])
def test_silence_to_a_wrong_target(autopilot, peer, target):
    assert peer.ask(peer.long(ARM, 1, target=target)) == []
    assert peer.ask(peer.int(ARM, 1, target=target)) == []
    assert autopilot.calls == []


def test_component_zero_means_us_too(autopilot, peer):
    assert acks(peer.ask(peer.long(ARM, 1, target=(1, 0)))) == [(ARM, ACCEPTED)]


@pytest.mark.parametrize(("command", "name"), [(519, "PROTOCOL_VERSION"), (520, "AUTOPILOT_VERSION")])
def test_version_requests_may_be_for_everyone(peer, command, name):
    answers = peer.ask(peer.long(command, 1, target=(0, 0)))
    assert acks(answers) == [(command, ACCEPTED)]
    assert answers[0].get_type() == name  # pymavlink does not know message 300


def test_a_packet_in_our_own_name_is_ignored(autopilot, make_peer):
    liar = make_peer(autopilot, system=1, component=1)
    assert liar.ask(liar.long(ARM, 1)) == []
    assert autopilot.calls == []


def test_takeoff_without_altitude_leaves_it_to_the_autopilot(autopilot, peer):
    peer.ask(peer.long(TAKEOFF, *[nan] * 7))
    ((name, altitude_m),) = autopilot.calls
    assert name == "takeoff"
    assert isnan(altitude_m)


def test_takeoff_above_home_in_a_relative_frame(autopilot, peer):
    peer.ask(peer.int(TAKEOFF, 0, 0, 0, 0, 0, 0, 5.0, frame=mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT))
    assert autopilot.calls == [("takeoff", 494.0)]


@pytest.mark.parametrize(
    ("command", "params", "text"),
    [
        (ARM, [5], "Unsupported ARM_DISARM param: 5"),
        (SET_MODE, [1, 4, 9], "Mode change refused: no mode 4.9 here"),
        (SET_MODE, [0, 4, 3], "Mode change refused: only PX4 custom modes are understood"),
        (262, [3], "Mode change refused: no standard mode 3 here"),
    ],
)
def test_a_refusal_has_a_text(autopilot, peer, command, params, text):
    peer.ask(peer.long(command, *params))
    assert [said.text for said in autopilot.texts] == [text]


def test_legacy_set_mode_is_acknowledged_as_do_set_mode(autopilot, peer):
    message = mavlink.MAVLink_set_mode_message(1, 1, FlightMode.LAND.custom_mode)
    assert acks(peer.ask(message)) == [(SET_MODE, ACCEPTED)]
    assert autopilot.calls == [("set_mode", FlightMode.LAND)]
    assert peer.ask(mavlink.MAVLink_set_mode_message(0, 1, FlightMode.LAND.custom_mode)) == []


@pytest.mark.parametrize("custom_mode", [0x6C066507, 0x06040001, 0, 0xFFFFFFFF])
def test_legacy_set_mode_takes_whole_mode_numbers_only(autopilot, peer, custom_mode):
    message = mavlink.MAVLink_set_mode_message(1, 1, custom_mode)
    assert acks(peer.ask(message)) == [(SET_MODE, REJECTED)]
    assert autopilot.calls == []


def test_autopilot_version_claims_what_px4_claims_and_global_targets(peer):
    answers = peer.ask(peer.long(REQUEST, 148))
    assert acks(answers) == [(REQUEST, ACCEPTED)]
    (version,) = [message for message in answers if message.get_type() == "AUTOPILOT_VERSION"]
    assert version.flight_sw_version == 0x011100FF
    assert version.capabilities == 0xE8FF | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
    assert version.uid & 0xFF == 1


def test_protocol_version_has_mavlinks_checksum_seed_and_layout(peer):
    answers = peer.ask(peer.long(REQUEST, 300))
    assert acks(answers) == [(REQUEST, ACCEPTED)]
    packet = answers[0].get_msgbuf()
    definition = b"PROTOCOL_VERSION uint16_t version uint16_t min_version uint16_t max_version "
    definition += b"uint8_t spec_version_hash \x08uint8_t library_version_hash \x08"
    crc = mavlink.x25crc(definition).crc  # the seed is made from the definition, as MAVLink says
    seed = bytes([crc & 0xFF ^ crc >> 8])
    assert mavlink.x25crc(bytes(packet[1:-2]) + seed).crc == int.from_bytes(packet[-2:], "little")
    assert bytes(packet[10:-2]) == bytes([200, 0, 100, 0, 203])  # trailing zeros are cut


@pytest.mark.parametrize(
    "name",
    ["HOME_POSITION", "GPS_GLOBAL_ORIGIN", "SYS_STATUS", "FLIGHT_INFORMATION", "CURRENT_MODE", "ATTITUDE"],
)
def test_request_message_gives_it_and_accepts(peer, name):
    answers = peer.ask(peer.long(REQUEST, getattr(mavlink, f"MAVLINK_MSG_ID_{name}")))
    assert [message.get_type() for message in answers] == [name, "COMMAND_ACK"]
    assert acks(answers) == [(REQUEST, ACCEPTED)]


def test_what_is_not_known_yet_is_denied(autopilot, peer):
    autopilot.status = VehicleStatus()
    assert acks(peer.ask(peer.long(REQUEST, 242))) == [(REQUEST, DENIED)]
    assert acks(peer.ask(peer.long(410))) == [(410, DENIED)]


def test_available_modes_all_and_one(peer):
    modes = [m for m in peer.ask(peer.long(REQUEST, 435, 0)) if m.get_type() == "AVAILABLE_MODES"]
    total = len(FlightMode)
    assert [m.mode_index for m in modes] == list(range(1, total + 1))
    assert {m.number_modes for m in modes} == {total}
    assert {m.custom_mode for m in modes} == {mode.custom_mode for mode in FlightMode}
    (one, _) = peer.ask(peer.long(REQUEST, 435, 5))
    assert (one.custom_mode, one.mode_name) == (FlightMode.HOLD.custom_mode, "Hold")
    assert acks(peer.ask(peer.long(REQUEST, 435, total + 1))) == [(REQUEST, DENIED)]


def test_available_modes_have_a_standard_mode_or_a_name(peer):
    modes = {m.custom_mode: m for m in peer.ask(peer.long(REQUEST, 435)) if m.get_type() == "AVAILABLE_MODES"}
    assert all((m.standard_mode == 0) == bool(m.mode_name) for m in modes.values())
    assert modes[FlightMode.RETURN.custom_mode].standard_mode == mavlink.MAV_STANDARD_MODE_SAFE_RECOVERY
    assert modes[FlightMode.POSITION.custom_mode].properties == 0
    assert modes[FlightMode.OFFBOARD.custom_mode].properties == mavlink.MAV_MODE_PROPERTY_ADVANCED
    assert modes[FlightMode.TERMINATION.custom_mode].properties & 2  # not to be chosen by a person


def test_intervals_belong_to_the_link_of_the_request(peer):
    attitude = mavlink.MAVLINK_MSG_ID_ATTITUDE
    peer.ask(peer.long(SET_INTERVAL, attitude, -1))
    names = [(link, message.get_type()) for link, message in peer.advance(1.0)]
    assert ("onboard", "ATTITUDE") not in names
    assert names.count(("ground", "ATTITUDE")) == pytest.approx(50, abs=1)


@pytest.mark.parametrize(
    ("message_id", "interval_us"), [(30, 10_000), (105, 20_000), (245, 200_000), (264, -1), (9999, 0)]
)
def test_message_interval_is_sent(peer, message_id, interval_us):
    for question in (peer.long(GET_INTERVAL, message_id), peer.long(REQUEST, 244, message_id)):
        told = peer.ask(question)[0]
        assert (told.get_type(), told.message_id, told.interval_us) == (
            "MESSAGE_INTERVAL",
            message_id,
            interval_us,
        )


def test_mavsdks_slow_extended_state_and_back(peer):
    extended = mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE
    for interval_us, expected in ((1_000_000, 4), (0, 20)):
        peer.ask(peer.long(SET_INTERVAL, extended, interval_us))
        count = sum(link == "onboard" and m.get_msgId() == extended for link, m in peer.advance(4.0))
        assert count == pytest.approx(expected, abs=1)


PLACE = GeodeticPoint(HOME.latitude_deg + 1e-4, HOME.longitude_deg - 2e-4, HOME.altitude_m + 30.0)
PLACE_NED_M = pytest.approx((11.12, -15.05, -30.0), abs=0.05)


def command_int(command, params, point, *, frame=mavlink.MAV_FRAME_GLOBAL):
    x, y = round(point.latitude_deg * 1e7), round(point.longitude_deg * 1e7)
    return mavlink.MAVLink_command_int_message(1, 1, frame, command, 0, 0, *params, x, y, point.altitude_m)


def test_a_place_to_go_to_is_found_in_the_local_frame(autopilot, peer):
    answers = peer.ask(command_int(192, [3.0, 1, 0, 0.5], PLACE))
    assert acks(answers) == [(192, ACCEPTED)]
    assert autopilot.calls == [("reposition", PLACE_NED_M, 0.5, 3.0)]


def test_a_height_above_home_counts_from_home(autopilot, peer):
    point = GeodeticPoint(PLACE.latitude_deg, PLACE.longitude_deg, 30.0)
    peer.ask(command_int(192, [-1, 1, 0, 0.5], point, frame=mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT))
    ((_, target, _, speed_m_s),) = autopilot.calls
    assert target == PLACE_NED_M
    assert isnan(speed_m_s)


def test_what_a_reposition_leaves_open_stays_open(autopilot, peer):
    peer.ask(peer.long(192, -1, 1, 0, nan, nan, nan, HOME.altitude_m + 5))
    ((_, (north_m, east_m, down_m), yaw_rad, _),) = autopilot.calls
    assert isnan(north_m + yaw_rad)
    assert isnan(east_m)
    assert down_m == pytest.approx(-5.0)


@pytest.mark.parametrize("number", [192, 34, 195])
def test_nowhere_on_earth_is_denied(autopilot, peer, number):
    assert acks(peer.ask(peer.long(number, 5, 1, 0, 0, 200.0, 0.0, 0.0))) == [(number, DENIED)]
    assert autopilot.calls == []


def test_an_orbit_keeps_its_direction(autopilot, peer):
    peer.ask(command_int(34, [-20.0, 3.0, 3, nan], PLACE))
    ((_, orbit),) = autopilot.calls
    assert orbit.centre_ned_m == PLACE_NED_M
    assert (orbit.radius_m, orbit.speed_m_s) == (20.0, -3.0)
    assert orbit.yaw is OrbitYaw.TANGENT


def test_a_region_of_interest_and_home_are_places(autopilot, peer):
    peer.ask(command_int(195, [0, 0, 0, 0], PLACE))
    peer.ask(command_int(179, [0, 0, 0, 0], PLACE))
    (looked, homed) = autopilot.calls
    assert looked == ("look_at", PLACE_NED_M)
    assert homed[0] == "set_home"
    assert homed[1].latitude_deg == pytest.approx(PLACE.latitude_deg, abs=1e-7)


def test_altitudes_of_circles_and_home_count_from_the_sea_whatever_the_frame(autopilot, peer):
    """MAVSDK sends a relative frame with an absolute altitude for both; PX4 ignores the frame."""
    place = (round(PLACE.latitude_deg * 1e7), round(PLACE.longitude_deg * 1e7), PLACE.altitude_m)
    peer.ask(peer.int(34, 20.0, 3.0, 0, nan, *place, frame=mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT))
    peer.ask(peer.int(179, 0, 0, 0, 0, *place, frame=mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT))
    (circled, homed) = autopilot.calls
    assert circled[1].centre_ned_m == PLACE_NED_M
    assert homed[1].altitude_m == PLACE.altitude_m


def test_termination_needs_an_armed_vehicle(autopilot, peer):
    autopilot.status.armed = True
    assert acks(peer.ask(peer.long(185, 1))) == [(185, ACCEPTED)]
    assert autopilot.calls == [("terminate",)]


@pytest.mark.parametrize(("command", "result"), [(246, DENIED), (310, DENIED), (401, REJECTED)])
def test_reboot_actuator_test_and_checks_are_refused_while_armed(autopilot, peer, command, result):
    autopilot.status.armed = True
    assert acks(peer.ask(peer.long(command, 1))) == [(command, result)]
    assert autopilot.texts == []


def test_calibration_sends_the_texts_that_stations_follow(autopilot, peer):
    peer.ask(peer.long(241, 0, 0, 0, 0, 1))
    said = [text.text for text in autopilot.texts]
    assert said[0] == "[cal] calibration started: 2 accel"
    assert said[-1] == "[cal] calibration done: accel"
