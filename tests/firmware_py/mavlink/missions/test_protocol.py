"""The mission protocol without a flight: requests, answers, stored plans."""

from math import isnan, nan
from struct import unpack_from

import pytest

from firmware_py.missions.items import PlanType
from firmware_py.status import CommandResult, FlightMode
from framerunner.wire.dialect import mavlink

MISSION, FENCE, RALLY = PlanType
LATITUDE, LONGITUDE = 473977420, 85455940
HERE = (0, 0, 0, nan)
OK, ERROR = mavlink.MAV_MISSION_ACCEPTED, mavlink.MAV_MISSION_ERROR


def item(
    seq, command=16, *, frame=6, params=(0, 0, 0, nan), x=LATITUDE, y=LONGITUDE, z=10.0, plan=0, current=0
):
    return mavlink.MAVLink_mission_item_int_message(
        1, 1, seq, frame, command, current, 1, *params, x, y, z, plan
    )


def waypoints(count, *, north=0, current=None, plan=0, command=16, params=HERE):
    return [
        item(
            seq,
            command,
            params=params,
            x=LATITUDE + north + 100 * seq,
            plan=plan,
            current=int(seq == current),
        )
        for seq in range(count)
    ]


def count_of(items, plan=0):
    return mavlink.MAVLink_mission_count_message(1, 1, len(items), plan)


def upload(peer, items, link="onboard", plan=0):
    """Upload and give all answers."""
    answers = peer.ask(count_of(items, plan), link)
    for message in items:
        if answers[-1].get_type() != "MISSION_REQUEST_INT":
            break
        answers += peer.ask(message, link)
    return answers


def download(peer, plan=0, link="onboard", as_int=True):
    (count,) = peer.ask(mavlink.MAVLink_mission_request_list_message(1, 1, plan), link)
    request = (
        mavlink.MAVLink_mission_request_int_message if as_int else mavlink.MAVLink_mission_request_message
    )
    return [peer.ask(request(1, 1, seq, plan), link)[0] for seq in range(count.count)]


def payload(message, size):
    """The payload with the zeros that MAVLink 2 cuts off."""
    packet = bytes(message.get_msgbuf())
    return packet[10 : 10 + packet[1]].ljust(size, b"\0")


def acknowledgement(message):
    """(result, plan type, opaque id) of MISSION_ACK."""
    assert message.get_type() == "MISSION_ACK"
    assert (message.target_system, message.target_component) == (245, 191)
    return message.type, message.mission_type, unpack_from("<I", payload(message, 8), 4)[0]


def current_message(peer):
    peer.send(peer.long(512, mavlink.MAVLINK_MSG_ID_MISSION_CURRENT))
    return [m for link, m in peer.take() if m.get_type() == "MISSION_CURRENT" and link == "onboard"][-1]


def current_of(peer):
    return unpack_from("<HHBBIII", payload(current_message(peer), 18))


def texts(autopilot):
    return [text.text for text in autopilot.texts]


@pytest.fixture
def told(autopilot):
    return lambda: texts(autopilot)


@pytest.fixture
def quiet(autopilot, make_peer):
    """A peer whose node leaves the autopilot's texts to the test."""
    peer = make_peer(autopilot)
    autopilot.take_texts = list
    return peer


@pytest.mark.parametrize("plan", list(PlanType))
def test_plans_are_empty_at_first(peer, plan):
    (count,) = peer.ask(mavlink.MAVLink_mission_request_list_message(1, 1, plan))
    assert (count.get_type(), count.count, count.mission_type) == ("MISSION_COUNT", 0, plan)
    assert (count.target_system, count.target_component) == (245, 191)


@pytest.mark.parametrize(
    ("plan", "items"),
    [
        (MISSION, waypoints(4)),
        (FENCE, waypoints(4, plan=1, command=5001, params=(4, 0, 0, 0))),
        (RALLY, waypoints(2, plan=2, command=5100)),
    ],
)
def test_an_upload_is_requested_item_by_item_and_read_back_the_same(peer, autopilot, plan, items):
    answers = upload(peer, items, plan=plan)
    assert [answer.get_type() for answer in answers] == ["MISSION_REQUEST_INT"] * len(items) + ["MISSION_ACK"]
    assert [answer.seq for answer in answers[:-1]] == list(range(len(items)))
    result, plan_type, opaque_id = acknowledgement(answers[-1])
    assert (result, plan_type) == (OK, plan)
    assert opaque_id == autopilot.missions.plan(plan).opaque_id != 0
    for sent, read in zip(items, download(peer, plan), strict=True):
        for field in ("seq", "frame", "command", "x", "y", "z", "autocontinue", "mission_type"):
            assert getattr(read, field) == getattr(sent, field), field
        assert (read.param1, read.param2, read.param3) == (sent.param1, sent.param2, sent.param3)
        assert read.param4 == sent.param4 or (isnan(read.param4) and isnan(sent.param4))
    (count,) = peer.ask(mavlink.MAVLink_mission_request_list_message(1, 1, plan))
    assert unpack_from("<I", payload(count, 9), 5)[0] == opaque_id


def test_ids_differ_with_the_plan_and_mission_current_shows_them(quiet, autopilot):
    peer = quiet
    ids = []
    for plan, items in [
        (MISSION, waypoints(3)),
        (FENCE, waypoints(1, plan=1, command=5003, params=(500, 0, 0, 0))),
        (RALLY, waypoints(1, plan=2, command=5100)),
    ]:
        ids.append(acknowledgement(upload(peer, items, plan=plan)[-1])[2])
    assert len(set(ids)) == 3
    assert current_of(peer)[4:] == tuple(ids)
    assert acknowledgement(upload(peer, waypoints(3, north=7))[-1])[2] != ids[0]
    assert acknowledgement(upload(peer, waypoints(3))[-1])[2] == ids[0]
    peer.ask(mavlink.MAVLink_mission_clear_all_message(1, 1, 0))
    assert current_of(peer) == (0, 0xFFFF, mavlink.MISSION_STATE_NO_MISSION, 2, 0, ids[1], ids[2])


@pytest.mark.parametrize(
    ("bad", "result"),
    [
        ({"frame": 9}, mavlink.MAV_MISSION_UNSUPPORTED_FRAME),
        ({"frame": 1}, mavlink.MAV_MISSION_UNSUPPORTED_FRAME),
        ({"command": 18}, mavlink.MAV_MISSION_UNSUPPORTED),
        ({"command": 31999}, mavlink.MAV_MISSION_UNSUPPORTED),
        ({"command": 178}, mavlink.MAV_MISSION_UNSUPPORTED),
        ({"command": 16, "frame": 2}, mavlink.MAV_MISSION_UNSUPPORTED),
        ({"command": 531, "frame": 2}, mavlink.MAV_MISSION_UNSUPPORTED),
        ({"command": 5001}, ERROR),
        ({"command": 80, "params": (1, 0, 0, 0)}, mavlink.MAV_MISSION_INVALID_PARAM1),
        ({"command": 201, "frame": 2, "params": (3, 0, 0, 0)}, mavlink.MAV_MISSION_INVALID_PARAM1),
        ({"command": 177, "frame": 2, "params": (nan, 0, 0, 0)}, mavlink.MAV_MISSION_INVALID_PARAM1),
        ({"command": 177, "frame": 2, "params": (0, nan, 0, 0)}, mavlink.MAV_MISSION_INVALID_PARAM2),
        ({"x": 910_000_000}, mavlink.MAV_MISSION_INVALID_PARAM5_X),
        ({"y": -1_810_000_000}, mavlink.MAV_MISSION_INVALID_PARAM6_Y),
        ({"z": float("inf")}, mavlink.MAV_MISSION_INVALID_PARAM7),
    ],
)
def test_a_bad_item_ends_the_upload_there_and_keeps_the_old_plan(quiet, autopilot, told, bad, result):
    peer = quiet
    upload(peer, waypoints(2))
    before = autopilot.missions.mission
    answers = upload(peer, [*waypoints(1, north=50), item(1, **bad), item(2)])
    assert len(answers) == 3
    assert acknowledgement(answers[-1])[:2] == (result, MISSION)
    assert autopilot.missions.mission is before
    assert told()[-1].startswith("IGN MISSION_ITEM: Invalid item 2: ")
    assert acknowledgement(peer.ask(item(1, **bad))[0])[0] == result  # the acknowledgement got lost
    assert acknowledgement(upload(peer, waypoints(2, north=9))[-1])[0] == OK


@pytest.mark.parametrize("command", [20, 93, 112, 177, 178, 179, 187, 189, 196, 197, 200, 203, 204, 205, 206])
def test_commands_without_a_place(peer, command):
    assert acknowledgement(upload(peer, [item(0, command, frame=2, params=(0, 0, 0, 0))])[-1])[0] == OK


@pytest.mark.parametrize("command", [211, 214, 530, 532, 1000, 1001, 2000, 2001, 2003, 2500, 2501, 42600])
def test_commands_to_devices(peer, command):
    message = item(0, command, frame=2, params=(0, 0, 0, 0), x=0x7FFF_FFFF, y=5, z=nan)
    assert acknowledgement(upload(peer, [message])[-1])[0] == OK
    (read,) = download(peer)
    assert (read.x, read.y) == (0x7FFF_FFFF, 5)


def test_odd_items_that_are_taken(peer):
    odd = [
        item(0, z=nan),
        item(1, 22, x=0x7FFF_FFFF, y=0x7FFF_FFFF),
        item(2, frame=0),
        item(3, frame=5, z=500),
    ]
    assert acknowledgement(upload(peer, odd)[-1])[0] == OK
    read = download(peer)
    assert isnan(read[0].z)
    assert (read[1].x, read[1].y) == (0x7FFF_FFFF, 0x7FFF_FFFF)
    assert [message.frame for message in read] == [6, 6, 5, 5]


def test_the_old_float_messages_work_both_ways(peer):
    (request,) = peer.ask(mavlink.MAVLink_mission_count_message(1, 1, 1, 0))
    assert request.get_type() == "MISSION_REQUEST_INT"
    (request,) = peer.ask(mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_UNSUPPORTED, 0))
    assert (request.get_type(), request.seq) == ("MISSION_REQUEST", 0)
    message = mavlink.MAVLink_mission_item_message(1, 1, 0, 3, 16, 0, 1, 1, 2, 3, 4, 47.5, 8.5, 20, 0)
    (answer,) = peer.ask(message)
    assert acknowledgement(answer)[0] == OK
    (read,) = download(peer, as_int=False)
    assert (read.frame, read.x, read.y, read.z) == (3, 47.5, 8.5, 20)
    (read,) = download(peer)
    assert (read.frame, read.x, read.y) == (6, 475000000, 85000000)


def test_a_link_is_asked_in_the_form_that_it_used_last(peer):
    float_item = [
        mavlink.MAVLink_mission_item_message(1, 1, seq, 3, 16, 0, 1, 1, 2, 3, 4, 47.5, 8.5, 20, 0)
        for seq in range(2)
    ]
    (request,) = peer.ask(mavlink.MAVLink_mission_count_message(1, 1, 2, 0))
    assert request.get_type() == "MISSION_REQUEST_INT"
    (request,) = peer.ask(float_item[0])
    assert (request.get_type(), request.seq) == ("MISSION_REQUEST", 1)
    assert acknowledgement(peer.ask(float_item[1])[0])[0] == OK
    kinds = []
    for link, as_int in [("onboard", True), ("onboard", False), ("ground", True), ("onboard", None)]:
        if as_int is not None:
            download(peer, link=link, as_int=as_int)
        (request,) = peer.ask(mavlink.MAVLink_mission_count_message(1, 1, 1, 0), link)
        kinds.append(request.get_type())
        peer.ask(mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_OPERATION_CANCELLED, 0), link)
    assert kinds == ["MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_REQUEST"]


def test_float_items_have_no_int_frame(peer):
    peer.ask(mavlink.MAVLink_mission_count_message(1, 1, 1, 0))
    message = mavlink.MAVLink_mission_item_message(1, 1, 0, 6, 16, 0, 1, 1, 2, 3, 4, 47.5, 8.5, 20, 0)
    assert acknowledgement(peer.ask(message)[0])[0] == mavlink.MAV_MISSION_UNSUPPORTED_FRAME


@pytest.mark.parametrize(("plan", "most"), [(MISSION, 10_000), (FENCE, 64), (RALLY, 32)])
def test_too_many_items(peer, plan, most):
    (answer,) = peer.ask(mavlink.MAVLink_mission_count_message(1, 1, most + 1, plan))
    assert acknowledgement(answer)[:2] == (mavlink.MAV_MISSION_NO_SPACE, plan)
    (request,) = peer.ask(mavlink.MAVLink_mission_count_message(1, 1, most, plan))
    assert request.get_type() == "MISSION_REQUEST_INT"


def test_an_upload_of_nothing_clears(peer, autopilot):
    upload(peer, waypoints(3))
    (answer,) = peer.ask(mavlink.MAVLink_mission_count_message(1, 1, 0, 0))
    assert acknowledgement(answer) == (OK, MISSION, 0)
    assert autopilot.missions.mission.items == ()


@pytest.mark.parametrize(
    ("mission_type", "left"), [(0, [0, 1, 1]), (1, [2, 0, 1]), (2, [2, 1, 0]), (255, [0, 0, 0])]
)
def test_clearing(peer, autopilot, mission_type, left):
    upload(peer, waypoints(2))
    upload(peer, waypoints(1, plan=1, command=5003, params=(500, 0, 0, 0)), plan=1)
    upload(peer, waypoints(1, plan=2, command=5100), plan=2)
    (answer,) = peer.ask(mavlink.MAVLink_mission_clear_all_message(1, 1, mission_type))
    assert acknowledgement(answer) == (OK, mission_type, 0)
    assert [len(autopilot.missions.plan(plan).items) for plan in PlanType] == left


@pytest.mark.parametrize(
    "message",
    [
        mavlink.MAVLink_mission_count_message(1, 1, 3, 77),
        mavlink.MAVLink_mission_request_list_message(1, 1, 77),
        mavlink.MAVLink_mission_request_int_message(1, 1, 0, 77),
        mavlink.MAVLink_mission_clear_all_message(1, 1, 77),
        mavlink.MAVLink_mission_request_partial_list_message(1, 1, 0, 3, 0),
        mavlink.MAVLink_mission_write_partial_list_message(1, 1, 0, 3, 0),
    ],
)
def test_what_is_not_there_is_answered(peer, message):
    (answer,) = peer.ask(message)
    assert acknowledgement(answer)[:2] == (mavlink.MAV_MISSION_UNSUPPORTED, message.mission_type)


@pytest.mark.parametrize("target", [(2, 1), (0, 0), (1, 55)])
def test_what_is_for_others_is_not_answered(peer, target):
    for message in (
        mavlink.MAVLink_mission_request_list_message(*target, 0),
        mavlink.MAVLink_mission_count_message(*target, 1, 0),
        mavlink.MAVLink_mission_clear_all_message(*target, 255),
    ):
        assert peer.ask(message) == []


def test_the_planner_s_component_id_counts_as_ours(peer):
    assert len(peer.ask(mavlink.MAVLink_mission_request_list_message(1, 190, 0))) == 1


def test_a_missing_item_is_requested_again_until_a_timeout(quiet, autopilot, told):
    peer = quiet
    peer.ask(count_of(waypoints(3)))
    peer.ask(waypoints(1)[0])
    asked = [m for _, m in peer.advance(1.0) if m.get_type() == "MISSION_REQUEST_INT"]
    assert [m.seq for m in asked] == [1] * len(asked)
    assert len(asked) == 3  # each 250 ms and a tick
    answers = [m for _, m in peer.advance(4.5) if m.get_type() == "MISSION_ACK"]
    assert [acknowledgement(m)[:2] for m in answers] == [(mavlink.MAV_MISSION_OPERATION_CANCELLED, MISSION)]
    assert "Operation timeout" in told()
    assert autopilot.missions.mission.items == ()
    assert not [m for _, m in peer.advance(1.0) if m.get_type().startswith("MISSION_REQUEST")]
    assert acknowledgement(upload(peer, waypoints(3))[-1])[0] == OK


def test_doubles_and_items_out_of_turn_change_nothing(peer, autopilot):
    items = waypoints(3)
    peer.ask(count_of(items))
    assert [m.seq for m in peer.ask(count_of(items))] == [0]  # came twice
    assert [m.seq for m in peer.ask(items[0])] == [1]
    assert peer.ask(items[0]) == []
    assert peer.ask(items[2]) == []
    assert [m.seq for m in peer.ask(count_of(items))] == [1]
    assert [m.seq for m in peer.ask(items[1])] == [2]
    (answer,) = peer.ask(items[2])
    assert acknowledgement(answer)[0] == OK
    assert acknowledgement(peer.ask(items[2])[0]) == acknowledgement(answer)
    assert [stored.seq for stored in autopilot.missions.mission.items] == [0, 1, 2]


def test_a_client_that_restarts_begins_at_the_first_item(peer):
    items = waypoints(3)
    peer.ask(count_of(items))
    peer.ask(items[0])
    peer.advance(0.6)
    assert [m.seq for m in peer.ask(count_of(items))] == [0]
    assert [m.seq for m in peer.ask(count_of(items[:2]))] == [0]
    answers = [peer.ask(message)[0] for message in items[:2]]
    assert acknowledgement(answers[-1])[0] == OK


def test_the_sender_cancels(peer, autopilot):
    items = waypoints(3)
    peer.ask(count_of(items))
    peer.ask(items[0])
    cancel = mavlink.MAV_MISSION_OPERATION_CANCELLED
    assert peer.ask(mavlink.MAVLink_mission_ack_message(1, 1, cancel, 0)) == []
    assert not [m for _, m in peer.advance(6.0) if m.get_type() in ("MISSION_REQUEST_INT", "MISSION_ACK")]
    assert autopilot.missions.mission.items == ()


def test_a_second_uploader_is_refused_and_disturbs_nothing(quiet, autopilot):
    peer = quiet
    items = waypoints(2)
    peer.ask(count_of(items))
    (answer,) = peer.ask(count_of(items), link="ground")
    assert acknowledgement(answer)[:2] == (ERROR, MISSION)
    peer.packer.srcSystem = 200
    (answer,) = peer.ask(mavlink.MAVLink_mission_count_message(1, 1, 5, 1))
    assert (answer.type, answer.mission_type, answer.target_system) == (ERROR, FENCE, 200)
    (answer,) = peer.ask(mavlink.MAVLink_mission_clear_all_message(1, 1, 255))
    assert answer.type == ERROR
    assert peer.ask(items[0]) == []
    peer.packer.srcSystem = 245
    answers = [peer.ask(message)[0] for message in items]
    assert acknowledgement(answers[-1])[0] == OK
    assert len(autopilot.missions.mission.items) == 2


def test_items_without_an_upload_are_errors(quiet, told):
    (answer,) = quiet.ask(item(0))
    assert acknowledgement(answer)[:2] == (ERROR, MISSION)
    assert told() == ["IGN MISSION_ITEM: No transfer"]


def test_items_of_another_type_than_announced_are_errors(peer, autopilot):
    peer.ask(mavlink.MAVLink_mission_count_message(1, 1, 1, 2))
    (answer,) = peer.ask(item(0))
    assert acknowledgement(answer)[:2] == (ERROR, MISSION)
    (answer,) = peer.ask(item(0, 5100, plan=2))
    assert acknowledgement(answer)[:2] == (OK, RALLY)


def test_a_download_shows_one_plan_even_if_it_changes_meanwhile(peer, autopilot):
    upload(peer, waypoints(2))
    peer.ask(mavlink.MAVLink_mission_request_list_message(1, 1, 0), link="ground")
    upload(peer, waypoints(1, north=999))
    request = mavlink.MAVLink_mission_request_int_message
    read = [peer.ask(request(1, 1, seq, 0), link="ground")[0] for seq in (1, 0, 1)]
    assert [message.x for message in read] == [LATITUDE + 100, LATITUDE, LATITUDE + 100]
    peer.ask(mavlink.MAVLink_mission_ack_message(1, 1, 0, 0), link="ground")
    (answer,) = peer.ask(request(1, 1, 1, 0), link="ground")
    assert answer.type == ERROR


@pytest.mark.parametrize("plan_type", [MISSION, RALLY])
def test_fence_items_belong_to_a_fence(peer, plan_type):
    (answer,) = upload(peer, waypoints(1, plan=plan_type, command=5003, params=(5, 0, 0, 0)), plan=plan_type)[
        1:
    ]
    assert answer.type != OK


@pytest.mark.parametrize(
    ("items", "text"),
    [
        (
            [item(0, 5001, params=(2, 0, 0, 0), plan=1)],
            "IGN MISSION_ITEM: Invalid item 1: a polygon needs 3 vertices",
        ),
        (
            waypoints(3, plan=1, command=5001, params=(4, 0, 0, 0)),
            "Fence item 1: a polygon of 4 vertices, 3 given",
        ),
    ],
)
def test_a_fence_that_makes_no_sense(quiet, autopilot, told, items, text):
    assert acknowledgement(upload(quiet, items, plan=1)[-1])[0] == ERROR
    assert told() == [text]
    assert autopilot.missions.fence.items == ()


def test_a_circle_without_a_radius_somewhere_else_is_taken_and_left_out(quiet, autopilot, told):
    answers = upload(quiet, [item(0, 5003, params=(0, 0, 0, 0), x=0, y=0, plan=1)], plan=1)
    assert acknowledgement(answers[-1])[0] == OK
    assert told() == ["Geofence invalid, doesn't contain Home position: circle of item 1"]


def test_a_mission_that_cannot_be_flown_is_taken_but_not_valid(quiet, autopilot, told):
    answers = upload(quiet, [item(0, 16), item(1, 22)])
    assert acknowledgement(answers[-1])[0] == OK
    assert told() == ["Mission rejected: takeoff not first waypoint item"]
    assert not autopilot.missions.valid
    assert current_of(quiet)[2] == mavlink.MISSION_STATE_NO_MISSION


def test_a_fence_can_make_a_mission_impossible_and_possible_again(quiet, autopilot):
    upload(quiet, [item(0), item(1, x=LATITUDE + 10_000)])  # 111 m north
    assert autopilot.missions.valid
    upload(quiet, [item(0, 5003, params=(50, 0, 0, 0), plan=1)], plan=1)
    assert not autopilot.missions.valid
    quiet.ask(mavlink.MAVLink_mission_clear_all_message(1, 1, 1))
    assert autopilot.missions.valid


def test_a_mission_is_checked_as_soon_as_home_is_known(quiet, autopilot):
    home, autopilot.status.home = autopilot.status.home, None
    upload(quiet, waypoints(2))
    assert not autopilot.missions.valid
    autopilot.status.home = home
    quiet.advance(0.01)
    assert autopilot.missions.valid


def test_mission_states(quiet, autopilot):
    peer, store, status = quiet, autopilot.missions, autopilot.status
    assert current_of(peer)[:4] == (0, 0xFFFF, mavlink.MISSION_STATE_NO_MISSION, 2)
    upload(peer, waypoints(3, current=1))
    assert current_of(peer)[:4] == (1, 3, mavlink.MISSION_STATE_NOT_STARTED, 2)
    status.mode, store.started = FlightMode.MISSION, True
    assert current_of(peer)[:4] == (1, 3, mavlink.MISSION_STATE_ACTIVE, 1)
    status.mode = FlightMode.HOLD
    assert current_of(peer)[:4] == (1, 3, mavlink.MISSION_STATE_PAUSED, 2)
    store.finished = True
    assert current_of(peer)[:4] == (1, 3, mavlink.MISSION_STATE_COMPLETE, 2)


def test_set_current_is_broadcast_at_once_on_all_links(quiet, autopilot, told):
    upload(quiet, waypoints(3))
    quiet.send(mavlink.MAVLink_mission_set_current_message(1, 1, 2))
    assert [(link, m.seq) for link, m in quiet.take() if m.get_type() == "MISSION_CURRENT"] == [
        ("onboard", 2),
        ("ground", 2),
    ]
    assert autopilot.missions.current == 2
    quiet.send(mavlink.MAVLink_mission_set_current_message(1, 1, 3))
    assert autopilot.missions.current == 2
    assert told()[-1] == "WPM: WP CURR CMD: Not in list: 3 of 3"


def test_a_reached_item_is_broadcast_at_once_and_ten_times_more(quiet, autopilot):
    upload(quiet, waypoints(3))
    quiet.advance(0.1)
    autopilot.missions.report_reached(0)
    autopilot.missions.current = 1
    told = [(link, m) for link, m in quiet.advance(0.02)]
    assert [(link, m.seq) for link, m in told if m.get_type() == "MISSION_ITEM_REACHED"] == [
        ("onboard", 0),
        ("ground", 0),
    ]
    assert {m.seq for _, m in told if m.get_type() == "MISSION_CURRENT"} == {1}
    again = [m for link, m in quiet.advance(15, step_us=20_000) if m.get_type() == "MISSION_ITEM_REACHED"]
    assert len(again) == 2 * 10


def result(peer, command, *params):
    return [m.result for m in peer.ask(peer.long(command, *params)) if m.get_type() == "COMMAND_ACK"]


@pytest.mark.parametrize(
    ("items", "first", "answer", "calls"),
    [
        (0, 0, CommandResult.DENIED, []),
        (3, 3, CommandResult.DENIED, []),
        (3, nan, CommandResult.ACCEPTED, [("set_mode", FlightMode.MISSION), ("arm", False)]),
        (3, -2, CommandResult.DENIED, []),
        (3, 2, CommandResult.ACCEPTED, [("set_mode", FlightMode.MISSION), ("arm", False)]),
        (3, -1, CommandResult.ACCEPTED, [("set_mode", FlightMode.MISSION), ("arm", False)]),
    ],
)
def test_starting_a_mission(quiet, autopilot, items, first, answer, calls):
    if items:
        upload(quiet, waypoints(items, current=1))
    assert result(quiet, 300, first) == [answer]
    assert autopilot.calls == calls
    assert autopilot.missions.current == (2 if first == 2 else 1 if items else 0)


def test_a_start_that_the_autopilot_refuses(quiet, autopilot):
    upload(quiet, waypoints(2))
    autopilot.result = CommandResult.DENIED
    assert result(quiet, 300, 0) == [CommandResult.TEMPORARILY_REJECTED]


@pytest.mark.parametrize(("seq", "answer"), [(1, 0), (2, 2), (nan, 2), (-1, 2)])
def test_choosing_an_item_by_command(quiet, autopilot, seq, answer):
    upload(quiet, waypoints(2))
    assert result(quiet, 224, seq) == [answer]
    assert autopilot.missions.current == (1 if answer == 0 else 0)
