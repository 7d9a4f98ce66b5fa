from dataclasses import replace
from itertools import product

import pytest

from firmware_py import commander_guards as when
from firmware_py.commander import Commander
from firmware_py.commander_guards import NEVER_US, Situation, Timeouts
from firmware_py.commander_table import FLOWN_MODE, RULES, TABLE, Event, State, first_match, mermaid
from firmware_py.parameters import Parameters
from firmware_py.status import CommandResult, FlightMode

NOW = 100_000_000
LONG_AGO = 1_000_000
ARMED = set(FLOWN_MODE)
COMMANDS = [event for event in Event if event is not Event.TICK]
OK, NO = CommandResult.ACCEPTED, CommandResult.TEMPORARILY_REJECTED

FLYING = Situation(
    now_us=NOW,
    unsound_us=0,
    sound_us=NOW,
    upright_us=NOW,
    airborne_us=NOW,
    landed=False,
    flown=True,
    setpoint_us=NOW,
    entered_us=NOW,
    armed_us=LONG_AGO,
)
STANDING = replace(FLYING, airborne_us=NEVER_US, landed=True, flown=False, armed_us=NOW)


def situations():
    """Every combination of what guards can tell apart."""
    return [
        Situation(
            now_us=NOW,
            unsound_us=unsound_us,
            sound_us=sound_us,
            upright_us=upright_us,
            airborne_us=airborne_us,
            landed=airborne_us < NOW,
            flown=flown,
            target_reached=reached,
            setpoint_us=setpoint_us,
            entered_us=entered_us,
            armed_us=armed_us,
            intended=intended,
            timeouts=Timeouts(land_at_loss=land),
        )
        for (unsound_us, sound_us, upright_us, airborne_us, setpoint_us, entered_us, armed_us) in product(
            (LONG_AGO, NOW - 100_000),
            (NOW, LONG_AGO),
            (NOW, NOW - 4000, LONG_AGO),
            (NOW, NOW - 4000, LONG_AGO),
            (NOW, NEVER_US),
            (NOW, LONG_AGO),
            (NOW, LONG_AGO),
        )
        for flown, reached, land in product((False, True), repeat=3)
        for intended in FlightMode
    ]


SITUATIONS = situations()


@pytest.mark.parametrize("event", COMMANDS)
@pytest.mark.parametrize("state", State)
def test_every_command_has_an_answer_in_every_state_and_situation(state, event):
    for now in SITUATIONS:
        row = first_match(RULES[state, event], now)
        assert row is not None
        if row.result is not OK:
            assert row.text, "a refusal says why"
            assert row.target is None, "a refusal changes nothing"
            assert row.intends is None, "a refusal changes nothing"


def test_every_row_of_the_table_is_reached():
    fired = {
        id(row)
        for state in State
        for event in Event
        for now in SITUATIONS
        if (row := first_match(RULES[state, event], now)) is not None
    }
    assert [row for row in TABLE if id(row) not in fired] == []


# What a healthy vehicle does, flying with setpoints, row by row; "-" stays, "!" is refused.
#          ARM    DISARM   FORCE     HOLD   TAKEOFF  LAND   OFFBOARD
IN_FLIGHT = """
disarmed   hold   -        -         -      -        -      -
hold       -      !        disarmed  -      takeoff  land   offboard
takeoff    -      !        disarmed  hold   takeoff  land   offboard
land       -      !        disarmed  hold   takeoff  -      offboard
offboard   -      !        disarmed  hold   takeoff  land   -
loss_hold  -      !        disarmed  hold   takeoff  land   offboard
loss_land  -      !        disarmed  hold   takeoff  land   offboard
"""


def _expected():
    rows = [line.split() for line in IN_FLIGHT.split("\n") if line]
    assert [row[0] for row in rows] == [state.value for state in State]
    return [
        (State(state), event, cell)
        for state, *cells in rows
        for event, cell in zip(COMMANDS, cells, strict=True)
    ]


@pytest.mark.parametrize(("state", "event", "cell"), _expected())
def test_commands_in_flight(state, event, cell):
    row = first_match(RULES[state, event], FLYING)
    assert row is not None
    assert row.result is (NO if cell == "!" else OK)
    assert row.target is (None if cell in "-!" else State(cell))


@pytest.mark.parametrize("state", State)
def test_nothing_happens_by_itself_when_all_is_well(state):
    row = first_match(RULES[state, Event.TICK], replace(FLYING))
    if state in {State.LOSS_HOLD, State.LOSS_LAND}:
        assert row is not None
        assert row.target is State.OFFBOARD  # setpoints come: resumed
    else:
        assert row is None


@pytest.mark.parametrize("state", State)
def test_only_arming_arms_and_only_when_checks_pass(state):
    for event, now in product(Event, SITUATIONS):
        row = first_match(RULES[state, event], now)
        if state is State.DISARMED and row is not None and row.target in ARMED:
            assert event is Event.ARM
            assert not when.unhealthy(now)
            assert now.intended is not FlightMode.LAND
            assert now.intended is not FlightMode.OFFBOARD or now.setpoint_us == NOW
            assert FLOWN_MODE[row.target] is now.intended


@pytest.mark.parametrize("state", sorted(ARMED, key=lambda state: state.value))
def test_in_the_air_only_force_or_a_hopeless_failure_stops_the_motors(state):
    for event, now in product(Event, SITUATIONS):
        row = first_match(RULES[state, event], now)
        if row is None or row.target is not State.DISARMED or now.landed:
            continue
        hopeless = event is Event.TICK and (when.sensors_lost(now) or when.tumbled(now))
        # "never flown" in the air cannot be: the commander sets `flown` with `landed` false.
        assert event is Event.FORCE_DISARM or hopeless or not now.flown


@pytest.mark.parametrize("state", sorted(ARMED, key=lambda state: state.value))
def test_failsafes_stand_before_all_else(state):
    for now in SITUATIONS:
        if when.sensors_lost(now) or when.tumbled(now):
            row = first_match(RULES[state, Event.TICK], now)
            assert row is not None
            assert row.target is State.DISARMED


@pytest.mark.parametrize("state", sorted(ARMED - {State.OFFBOARD}, key=lambda state: state.value))
def test_offboard_is_entered_only_with_setpoints(state):
    row = first_match(RULES[state, Event.SET_OFFBOARD], replace(FLYING, setpoint_us=NEVER_US))
    assert row is not None
    assert row.result is NO
    assert row.text == "Switching to Offboard is currently not available"


@pytest.mark.parametrize(
    ("state", "change", "target", "text"),
    [
        (State.HOLD, {"sound_us": NOW - 300_001}, State.DISARMED, "Sensors lost: motors stopped"),
        (State.HOLD, {"sound_us": NOW - 300_000}, None, ""),
        (State.LAND, {"upright_us": NOW - 300_001}, State.DISARMED, "Attitude failure: motors stopped"),
        (State.LAND, {"upright_us": NOW - 300_000}, None, ""),
        (State.HOLD, {"landed": True, "airborne_us": NOW - 2_000_000}, State.DISARMED, "Disarmed by landing"),
        (State.HOLD, {"landed": True, "airborne_us": NOW - 1_999_999}, None, ""),
        (
            State.HOLD,
            {"landed": True, "flown": False, "airborne_us": NEVER_US, "armed_us": NOW - 10_000_000},
            State.DISARMED,
            "Disarmed by auto preflight disarming",
        ),
        (
            State.LAND,
            {
                "landed": True,
                "flown": False,
                "airborne_us": NEVER_US,
                "armed_us": NOW,
                "entered_us": LONG_AGO,
            },
            State.DISARMED,
            "Disarmed by landing",
        ),
        (State.OFFBOARD, {"setpoint_us": NOW - 1_000_000}, None, ""),
        (
            State.OFFBOARD,
            {"setpoint_us": NOW - 1_000_001},
            State.LOSS_HOLD,
            "Failsafe activated: offboard setpoints lost, hold",
        ),
        (
            State.OFFBOARD,
            {"setpoint_us": NOW - 1_000_001, "timeouts": Timeouts(land_at_loss=True)},
            State.LOSS_LAND,
            "Failsafe activated: offboard setpoints lost, landing",
        ),
        (State.LOSS_HOLD, {"setpoint_us": NEVER_US, "entered_us": NOW - 4_999_999}, None, ""),
        (
            State.LOSS_HOLD,
            {"setpoint_us": NEVER_US, "entered_us": NOW - 5_000_000},
            State.LOSS_LAND,
            "Failsafe: landing",
        ),
        (
            State.LOSS_HOLD,
            {"setpoint_us": NEVER_US, "entered_us": NOW - 5_000_000, "landed": True},
            State.DISARMED,
            "Disarmed by failsafe",
        ),
        (State.TAKEOFF, {"target_reached": True}, State.HOLD, ""),
    ],
)
def test_what_a_tick_does(state, change, target, text):
    row = first_match(RULES[state, Event.TICK], replace(FLYING, **change))
    assert (row.target if row else None) is target
    assert (row.text if row else "") == text


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"unsound_us": NOW - 700_000}, "Arming denied: Resolve system health failures first"),
        ({"upright_us": NOW - 4000}, "Arming denied: Resolve system health failures first"),
        ({"intended": FlightMode.LAND}, "Arming denied: not in Land mode"),
        (
            {"intended": FlightMode.OFFBOARD, "setpoint_us": NEVER_US},
            "Arming denied: no offboard setpoints",
        ),
    ],
)
def test_why_arming_is_denied(change, text):
    row = first_match(RULES[State.DISARMED, Event.ARM], replace(STANDING, **change))
    assert row is not None
    assert (row.result, row.text) == (NO, text)


def test_disarming_on_the_ground():
    for state in ARMED:
        row = first_match(RULES[state, Event.DISARM], STANDING)
        assert row is not None
        assert (row.result, row.target, row.intends) == (OK, State.DISARMED, FlightMode.HOLD)


@pytest.mark.parametrize("wait", [-1.0, 0.0])
def test_automatic_disarming_can_be_turned_off(wait):
    commander = Commander()
    commander.configure(Parameters({"COM_DISARM_LAND": wait, "COM_DISARM_PRFLT": wait}))
    now = replace(STANDING, armed_us=LONG_AGO, airborne_us=LONG_AGO, timeouts=commander.situation.timeouts)
    for flown, state in product((False, True), (State.HOLD, State.LAND)):
        assert first_match(RULES[state, Event.TICK], replace(now, flown=flown)) is None


def test_parameters_set_the_times():
    commander = Commander()
    commander.configure(Parameters({"COM_OF_LOSS_T": 0.5, "COM_FAIL_ACT_T": 3.0, "COM_OBL_RC_ACT": 4}))
    assert commander.situation.timeouts == Timeouts(500_000, 3_000_000, 2_000_000, 10_000_000, True)


def _ticks(commander, start_us, count, **conditions):
    conditions = {"sound": True, "upright": True, "landed": True, "target_reached": False} | conditions
    for tick in range(count):
        commander.tick(start_us + 4000 * tick, **conditions)
    return start_us + 4000 * count


def test_ready_comes_with_settled_sensors_whenever_they_start():
    for first_us in (0, 3_000_000):
        commander = Commander()
        now_us = _ticks(commander, first_us, 200)
        assert not commander.ready
        _ticks(commander, now_us, 1)
        assert commander.ready


def test_one_bad_sample_starts_the_wait_again():
    commander = Commander()
    now_us = _ticks(commander, 0, 300)
    assert commander.ready
    now_us = _ticks(commander, now_us, 1, sound=False)
    assert not commander.ready
    _ticks(commander, now_us, 201)
    assert commander.ready


def test_a_setpoint_from_the_future_does_not_stay_fresh_for_ever():
    commander = Commander()
    now_us = _ticks(commander, 0, 300)
    commander.setpoint_came(10**12)
    assert not when.setpoint_lost(commander.situation)
    _ticks(commander, now_us, 300)
    assert when.setpoint_lost(commander.situation)


def test_the_diagram_shows_every_state_and_every_way_out_of_offboard():
    diagram = mermaid()
    assert diagram.startswith("stateDiagram-v2\n")
    for state in State:
        assert f"--> {state.value}:" in diagram
    assert "    armed --> disarmed: force_disarm\n" in diagram
    assert "    offboard --> loss_hold: [setpoint lost]\n" in diagram
    assert "    takeoff --> hold: [target reached]\n" in diagram
