"""The rules of a session: who answers, how often a request is sent, what it presents itself as."""

import pytest

from framerunner.wire.dialect import mavlink, request_message
from framerunner.wire.framing import PacketReader
from framerunner.wire.session.session import (
    ParameterValue,
    RateWatch,
    Request,
    Session,
    Wait,
    pose_rates,
)

ARM, TAKE_OFF = mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_CMD_NAV_TAKEOFF
IN_PROGRESS, DENIED = mavlink.MAV_RESULT_IN_PROGRESS, mavlink.MAV_RESULT_DENIED


def over_the_wire(message, system=1, component=1):
    (received,) = PacketReader().feed(message.pack(mavlink.MAVLink(None, system, component)))
    return received


def ack(number, result=0, *, target=250, component=1, system=1):
    message = mavlink.MAVLink_command_ack_message(number, result, 0, 0, target, 190)
    return over_the_wire(message, system, component)


def heartbeat(autopilot=mavlink.MAV_AUTOPILOT_PX4, armed=False, system=1):
    return over_the_wire(mavlink.MAVLink_heartbeat_message(2, autopilot, 128 * armed, 0, 3, 3), system)


def value(name, number=1.5, kind=mavlink.MAV_PARAM_TYPE_REAL32):
    return over_the_wire(mavlink.MAVLink_param_value_message(name.encode(), number, kind, 1, 0))


def test_a_command_is_sent_three_times_half_a_second_apart_and_then_given_up():
    session = Session(250, 1)
    command = session.command(ARM, 1.0)
    sent = [
        (now_s, each.confirmation) for now_s in (0.0, 0.4, 0.5, 0.9, 1.0, 1.4) for each in session.due(now_s)
    ]
    assert sent == [(0.0, 0), (0.5, 1), (1.0, 2)]
    assert not command.over
    assert session.due(1.5) == []
    assert (command.over, command.answer) == (True, None)
    assert session.due(2.0) == []


@pytest.mark.parametrize(
    "other",
    [
        ack(ARM, target=255),
        ack(ARM, component=100),
        ack(ARM, system=2),
        ack(TAKE_OFF),
        value("COM_OF_LOSS_T"),
    ],
    ids=[
        "to another station",
        "of the camera",
        "of another vehicle",
        "of another command",
        "another message",
    ],
)
def test_an_answer_counts_if_it_is_the_autopilots_to_this_client(other):
    session = Session(250, 1)
    command = session.command(ARM, 1.0)
    session.due(0.0)
    session.take(other, 0.1)
    assert not command.over
    session.take(ack(ARM, DENIED), 0.2)
    assert command.answer == DENIED


@pytest.mark.parametrize("target", [0, 250])
def test_an_answer_to_nobody_counts_too(target):
    session = Session(250, 1)
    command = session.command(ARM, 1.0)
    session.due(0.0)
    session.take(ack(ARM, target=target), 0.1)
    assert (command.over, command.answer) == (True, mavlink.MAV_RESULT_ACCEPTED)


def test_in_progress_lets_five_seconds_pass_before_it_is_sent_again():
    session = Session(250, 1)
    command = session.command(TAKE_OFF)
    session.due(0.0)
    session.take(ack(TAKE_OFF, IN_PROGRESS), 0.3)
    assert session.due(5.2) == []
    assert [each.confirmation for each in session.due(5.3)] == [1]
    assert not command.over


def test_commands_of_one_number_wait_for_each_other_and_others_do_not():
    session = Session(250, 1)
    first, second, other = session.command(ARM, 1.0), session.command(ARM, 0.0), session.command(TAKE_OFF)
    assert [(each.command, each.param1) for each in session.due(0.0)] == [(ARM, 1.0), (TAKE_OFF, 0.0)]
    session.take(ack(ARM), 0.1)
    assert (first.over, second.over, other.over) == (True, False, False)
    assert [(each.command, each.param1) for each in session.due(0.1)] == [(ARM, 0.0)]


def test_an_urgent_command_ends_an_earlier_one_of_its_number():
    session = Session(250, 1)
    first = session.command(ARM, 1.0)
    session.due(0.0)
    urgent = session.command(ARM, 0.0, 21196.0, urgent=True)
    assert (first.over, first.answer) == (True, None)
    assert [each.param2 for each in session.due(0.0)] == [21196.0]
    session.take(ack(ARM), 0.1)
    assert urgent.answer == mavlink.MAV_RESULT_ACCEPTED


def test_an_answer_before_the_request_was_sent_is_none():
    session = Session(250, 1)
    command = session.command(ARM, 1.0)
    session.take(ack(ARM), 0.0)
    assert not command.over


def test_who_waits_is_called_when_the_request_is_over():
    session, called = Session(250, 1), []
    session.command(ARM, 1.0).on_over = lambda: called.append(True)
    session.due(0.0)
    session.take(ack(ARM), 0.1)
    assert called == [True]


def test_the_beginning_of_an_answer_that_never_ends_is_given_up():
    request = Request(request_message(1, 2), lambda _: Wait(5.0, is_last=True))
    request.due(0.0)
    request.take(ack(ARM), 1.0)
    assert request.due(5.9) is None
    assert not request.over
    assert request.due(6.0) is None
    assert (request.over, request.answer) == (True, None)


def test_a_message_is_requested_until_it_comes():
    session = Session(250, 1)
    wanted = session.message(mavlink.MAVLINK_MSG_ID_SYSTEM_TIME, tries=3)
    assert [each.param1 for each in session.due(0.0)] == [mavlink.MAVLINK_MSG_ID_SYSTEM_TIME]
    assert len(session.due(0.5)) == 1
    session.take(over_the_wire(mavlink.MAVLink_system_time_message(5, 6)), 0.6)
    assert (wanted.answer.time_unix_usec, session.due(1.0)) == (5, [])


@pytest.mark.parametrize("number", [0, 3, -1])
@pytest.mark.parametrize("autopilot", [mavlink.MAV_AUTOPILOT_PX4, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA])
def test_an_integer_parameter_is_its_bytes_for_px4_and_its_value_for_ardupilot(number, autopilot):
    session = Session(250)
    session.take(heartbeat(autopilot), 0.0)
    wanted = ParameterValue("NAV_DLL_ACT", number, mavlink.MAV_PARAM_TYPE_INT32)
    setting = session.set_parameter(wanted)
    (sent,) = session.due(0.0)
    is_value = autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    if number >= 0:
        assert (sent.param_value == number) is (is_value or number == 0)
        session.take(value("COM_OBL_RC_ACT", sent.param_value, sent.param_type), 0.1)
        assert not setting.over
        session.take(value("NAV_DLL_ACT", sent.param_value, sent.param_type), 0.1)
        assert setting.answer == wanted


def test_a_parameter_is_requested_by_its_name():
    session = Session(250, 1)
    reading = session.parameter("COM_OF_LOSS_T")
    assert [each.param_id for each in session.due(0.0)] == ["COM_OF_LOSS_T"]
    session.take(value("COM_OF_LOSS_T"), 0.1)
    assert reading.answer == ParameterValue("COM_OF_LOSS_T", 1.5, mavlink.MAV_PARAM_TYPE_REAL32)


def kinds(session, now_s):
    return [each.type for each in session.due(now_s)]


def test_a_ground_station_is_one_to_a_disarmed_vehicle_that_was_heard():
    session = Session(250, heartbeat="ground station")
    companion, station = mavlink.MAV_TYPE_ONBOARD_CONTROLLER, mavlink.MAV_TYPE_GCS
    assert [kinds(session, now_s) for now_s in (0.0, 0.9, 1.0)] == [[companion], [], [companion]]
    session.take(heartbeat(), 1.1)
    assert [kinds(session, now_s) for now_s in (1.1, 2.0, 2.1)] == [[station], [], [station]]
    session.take(heartbeat(armed=True), 2.2)
    assert kinds(session, 2.2) == [companion]


def test_a_companion_stays_one_and_a_session_may_be_silent():
    session = Session(heartbeat="companion")
    session.take(heartbeat(), 0.0)
    assert kinds(session, 0.0) == [mavlink.MAV_TYPE_ONBOARD_CONTROLLER]
    assert Session().due(0.0) == []


def test_the_first_autopilot_that_is_heard_is_the_vehicle():
    session = Session()
    session.take(over_the_wire(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 3, 3), 255, 190), 0.0)
    assert session.system_id is None
    session.take(heartbeat(system=3), 0.1)
    session.take(heartbeat(system=4, armed=True), 0.2)
    assert (session.system_id, session.armed) == (3, False)


ATTITUDE = mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION
POSITION = mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED


def asked(messages):
    return [(each.target_system, each.command, each.param1, each.param2) for each in messages]


def slow_counts(attitudes, positions):
    return {ATTITUDE: attitudes, POSITION: positions}


@pytest.mark.parametrize("rate_hz", [15.0, 25.0, 50.0, 100.0])
def test_sufficient_rates_are_not_changed(rate_hz):
    watch = pose_rates(25.0, 0.6, 3.0, 0.0, 5)
    for second in range(1, 30):
        count = round(second * rate_hz)
        assert watch.requests(1, slow_counts(count, count), float(second)) == []


def test_only_slow_messages_are_requested_and_five_times_at_most():
    watch = pose_rates(25.0, 0.6, 3.0, 0.0, 5)
    assert watch.requests(3, slow_counts(10, 1), 1.0) == []
    assert asked(watch.requests(3, slow_counts(60, 4), 3.0)) == [(3, 511, POSITION, 40_000)]
    assert watch.requests(3, slow_counts(80, 5), 4.0) == []
    later = [watch.requests(3, slow_counts(60 + 20 * each, each), 3.0 + 3 * each) for each in range(1, 30)]
    assert [len(each) for each in later] == [2] * 4 + [0] * 25


def test_rates_are_requested_without_end_by_default():
    watch = RateWatch({ATTITUDE: 50.0}, 0.6, 1.0, 0.0)
    assert all(len(watch.requests(1, {}, float(second))) == 1 for second in range(1, 100))
    assert watch.rates_hz == {ATTITUDE: 0.0}
