"""Mission messages with random content: nothing raises, and a plan is complete or unchanged."""

from math import isfinite

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firmware_py.missions.executor import MissionExecutor
from firmware_py.missions.flight import VehicleView
from firmware_py.missions.geofence import Geofence
from firmware_py.missions.items import PlanType, opaque_id
from firmware_py.navigator import return_place
from framerunner.vehicle.geodesy import LocalProjection
from framerunner.wire.dialect import mavlink
from tests.firmware_py.mavlink.conftest import HOME, FakeAutopilot

FLOATS = st.one_of(
    st.sampled_from([0.0, -0.0, 1.0, -1.0, 3.0, 5.0, 1e-40, 3e38, -3e38, float("nan"), float("inf")]),
    st.floats(width=32),
)
COMMANDS = [
    16,
    17,
    18,
    19,
    20,
    21,
    22,
    31,
    80,
    93,
    112,
    115,
    177,
    178,
    189,
    195,
    196,
    197,
    201,
    206,
    214,
    400,
]
COMMANDS += [400, 1000, 2000, 2001, 2003, 3000, 4501, 5000, 5001, 5002, 5003, 5004, 5100, 42600, 31999]
COORDINATES = st.one_of(
    st.sampled_from([0, 473977420, 85455940, 0x7FFF_FFFF, -(2**31)]), st.integers(-(2**31), 2**31 - 1)
)
PLANS = st.sampled_from([0, 0, 0, 1, 2, 3, 255])
TARGETS = st.sampled_from([(1, 1), (1, 1), (1, 1), (1, 0), (1, 190), (0, 0), (2, 1)])
SMALL = st.integers(0, 4)


def item_ints(seq, plan=PLANS, target=TARGETS):
    return st.builds(
        lambda target, seq, frame, command, flags, params, x, y, z, plan: (
            mavlink.MAVLink_mission_item_int_message(
                *target, seq, frame, command, *flags, *params, x, y, z, plan
            )
        ),
        target,
        seq,
        st.sampled_from([0, 2, 2, 3, 5, 6, 9]),
        st.sampled_from(COMMANDS),
        st.tuples(st.sampled_from([0, 1, 255]), st.sampled_from([1, 1, 0])),
        st.tuples(FLOATS, FLOATS, FLOATS, FLOATS),
        COORDINATES,
        COORDINATES,
        FLOATS,
        plan,
    )


def item_floats():
    return st.builds(
        lambda target, seq, frame, command, params, place, plan: mavlink.MAVLink_mission_item_message(
            *target, seq, frame, command, 0, 1, *params, *place, plan
        ),
        TARGETS,
        SMALL,
        st.sampled_from([0, 2, 3, 6]),
        st.sampled_from(COMMANDS),
        st.tuples(FLOATS, FLOATS, FLOATS, FLOATS),
        st.tuples(FLOATS, FLOATS, FLOATS),
        PLANS,
    )


def simple(kind, *fields):
    return st.builds(lambda target, *values: kind(*target, *values), TARGETS, *fields)


MESSAGES = st.one_of(
    item_ints(SMALL),
    item_floats(),
    simple(mavlink.MAVLink_mission_count_message, st.one_of(SMALL, st.integers(0, 65535)), PLANS),
    simple(mavlink.MAVLink_mission_ack_message, st.integers(0, 20), PLANS),
    simple(mavlink.MAVLink_mission_request_list_message, PLANS),
    simple(mavlink.MAVLink_mission_request_int_message, SMALL, PLANS),
    simple(mavlink.MAVLink_mission_request_message, SMALL, PLANS),
    simple(mavlink.MAVLink_mission_request_partial_list_message, SMALL, SMALL, PLANS),
    simple(mavlink.MAVLink_mission_write_partial_list_message, SMALL, SMALL, PLANS),
    simple(mavlink.MAVLink_mission_clear_all_message, PLANS),
    simple(mavlink.MAVLink_mission_set_current_message, SMALL),
)
FUZZ = settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])


def is_whole(store):
    return all(
        [item.seq for item in plan.items] == list(range(len(plan.items)))
        and plan.opaque_id == opaque_id(plan.items)
        for plan in map(store.plan, PlanType)
    ) and 0 <= store.current <= max(0, len(store.mission.items) - 1)


@FUZZ
@given(st.lists(st.tuples(MESSAGES, st.sampled_from(["onboard", "ground"]), st.booleans()), max_size=25))
def test_any_messages_in_any_order(airframe, make_peer, sent):
    peer = make_peer(FakeAutopilot(airframe))
    for message, link, pause in sent:
        peer.send(message, link)
        peer.advance(6.0 if pause else 0.004, step_us=300_000)
    assert peer.node.failed_messages == 0
    assert is_whole(peer.autopilot.missions)


@FUZZ
@given(st.lists(item_ints(st.just(0), st.just(0), st.just((1, 1))), min_size=1, max_size=6), st.data())
def test_an_upload_is_whole_or_nothing_and_what_is_taken_can_be_flown(airframe, make_peer, items, data):
    autopilot = FakeAutopilot(airframe)
    peer = make_peer(autopilot)
    plan = data.draw(st.sampled_from(list(PlanType)))
    peer.ask(mavlink.MAVLink_mission_count_message(1, 1, len(items), plan))
    answer = None
    for seq, message in enumerate(items):
        message.seq, message.mission_type = seq, int(plan)
        (answer, *_) = peer.ask(message)
        if answer.get_type() == "MISSION_ACK":
            break
    taken = autopilot.missions.plan(plan).items
    assert len(taken) == (len(items) if answer.type == mavlink.MAV_MISSION_ACCEPTED else 0)
    assert is_whole(autopilot.missions)
    assert peer.node.failed_messages == 0
    for seq in range(len(taken)):
        (read,) = peer.ask(mavlink.MAVLink_mission_request_int_message(1, 1, seq, plan))
        assert (read.seq, read.command) == (seq, items[seq].command)
    fly(autopilot)


def fly(autopilot):
    """Accepted plans cause no error in flight, even if they are not valid."""
    store = autopilot.missions
    store.valid = bool(store.mission.items)
    view = VehicleView(projection=LocalProjection(HOME), home_ned_m=(0.0, 0.0, 0.0))
    executor = MissionExecutor(store, autopilot.parameters)
    fence = Geofence(store, autopilot.parameters)
    executor.enter(view)
    for tick in range(60):
        view.time_us += 400_000
        view.landed = tick % 20 == 0
        leg = executor.step(view)
        assert all(map(isfinite, leg.target_ned_m))
        view.position_ned_m = leg.target_ned_m
        fence.check(view)
        assert all(map(isfinite, return_place(view, store, autopilot.parameters)))
        executor.take_events()
    assert is_whole(store)
