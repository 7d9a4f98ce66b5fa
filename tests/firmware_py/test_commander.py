from dataclasses import replace
from itertools import product

import pytest

from firmware_py import commander_guards as when
from firmware_py.commander import Commander, Observation
from firmware_py.commander_guards import NEVER_US, Choices, FailsafeCause, Reaction, Situation, Timeouts
from firmware_py.commander_table import (
    FLOWN_MODE,
    RULES,
    TABLE,
    CommanderState,
    Event,
    first_match,
)
from firmware_py.parameters import Parameters
from firmware_py.status import CommandResult, FlightMode

NOW = 100_000_000
LONG_AGO = 1_000_000
ARMED = set(FLOWN_MODE)
COMMANDS = [event for event in (*Event, *FlightMode, *FailsafeCause) if event is not Event.TICK]
ARMING = (Event.ARM, Event.DISARM, Event.FORCE_DISARM, FlightMode.TERMINATION)
OK, NO = CommandResult.ACCEPTED, CommandResult.TEMPORARILY_REJECTED

FLYING = Situation(
    now_us=NOW,
    unusable_us=0,
    usable_us=NOW,
    position_us=NOW,
    manual_us=NOW,
    has_mission=True,
    upright_us=NOW,
    airborne_us=NOW,
    landed=False,
    flown=True,
    setpoint_us=NOW,
    entered_us=NOW,
    armed_us=LONG_AGO,
)
STANDING = replace(FLYING, airborne_us=NEVER_US, landed=True, flown=False, armed_us=NOW)


CHOICES = (
    Choices(),
    Choices(dict.fromkeys(FailsafeCause, Reaction.WARN), arm_needs_ground_station=True),
    *(
        Choices(dict.fromkeys(FailsafeCause, reaction), without_sticks=Reaction.RETURN)
        for reaction in Reaction
        if reaction not in {Reaction.NOTHING, Reaction.WARN}
    ),
)


def _flights():
    """Combinations of the vehicle's own conditions."""
    for unusable_us, usable_us, upright_us, airborne_us, flown in product(
        (LONG_AGO, NOW - 100_000),
        (NOW, LONG_AGO),
        (NOW, NOW - 4000, LONG_AGO),
        (NOW, LONG_AGO),
        (False, True),
    ):
        for entered_us, armed_us, reached in product((NOW, LONG_AGO), (NOW, LONG_AGO), (False, True)):
            yield {
                "unusable_us": unusable_us,
                "usable_us": usable_us,
                "upright_us": upright_us,
                "airborne_us": airborne_us,
                "landed": airborne_us < NOW,
                "flown": flown,
                "entered_us": entered_us,
                "armed_us": armed_us,
                "target_reached": reached,
            }


def _circumstances():
    """Combinations of inputs from outside."""
    for setpoint_us, position_us, manual_us, has_mission, intended in product(
        (NOW, NEVER_US), (NOW, LONG_AGO), (NOW, NEVER_US), (False, True), FlightMode
    ):
        yield {
            "setpoint_us": setpoint_us,
            "position_us": position_us,
            "manual_us": manual_us,
            "has_mission": has_mission,
            "intended": intended,
        }


def situations():
    """All vehicle conditions with normal inputs, and a normal flight with all inputs."""
    outside = {"setpoint_us": NOW, "position_us": NOW, "manual_us": NOW, "has_mission": True}
    found = [
        Situation(now_us=NOW, **flight, **outside, intended=intended)
        for flight in _flights()
        for intended in (FlightMode.OFFBOARD, FlightMode.LAND)
    ]
    ordinary = {"now_us": NOW, "usable_us": NOW, "upright_us": NOW, "armed_us": NOW, "entered_us": LONG_AGO}
    found += [
        Situation(
            **ordinary, landed=landed, flown=True, **around, choices=choices, cause=cause, follow_up=then
        )
        for around in _circumstances()
        for choices in CHOICES
        for landed, cause, then in (
            (False, None, Reaction.NOTHING),
            (True, None, Reaction.NOTHING),
            (False, FailsafeCause.SETPOINTS, Reaction.LAND),
            (False, FailsafeCause.MANUAL, Reaction.RETURN),
            (True, FailsafeCause.MANUAL, Reaction.RETURN),
        )
    ]
    found += [
        replace(STANDING, battery_arms=False),
        replace(STANDING, problem="barometer is stuck"),
        replace(STANDING, entered_us=LONG_AGO, follow_up=Reaction.LAND),
        replace(STANDING, choices=CHOICES[1]),
        replace(FLYING, target_reached=True, choices=Choices(mission_after_takeoff=True)),
    ]
    return found


SITUATIONS = situations()
SEVERITY = [
    CommanderState.FAILSAFE_HOLD,
    CommanderState.FAILSAFE_RETURN,
    CommanderState.FAILSAFE_LAND,
    CommanderState.TERMINATED,
]


@pytest.mark.parametrize("state", CommanderState)
def test_every_command_has_a_safe_answer_in_every_state_and_situation(state):
    for event, now in product(COMMANDS, SITUATIONS):
        row = first_match(RULES[state, event], now)
        assert row is not None, event
        if row.result is not OK:
            assert row.text, f"a refusal of {event} says why"
            assert row.target is None, f"a refusal of {event} changes nothing"
            assert row.intends is None, f"a refusal of {event} changes nothing"
        if row.target is not None and event in FailsafeCause:
            assert state not in {CommanderState.DISARMED, CommanderState.TERMINATED}, event
            if row.target in SEVERITY and state in SEVERITY:
                assert SEVERITY.index(row.target) >= SEVERITY.index(state), (
                    f"{event} never leads to a milder one"
                )
        if row.target is CommanderState.DISARMED:
            assert event is Event.FORCE_DISARM or may_stop_motors(state, event, row, now)
    for now in SITUATIONS:
        row = first_match(RULES[state, Event.TICK], now)
        if row is not None and row.target is CommanderState.DISARMED:
            assert may_stop_motors(state, Event.TICK, row, now)


def may_stop_motors(state, event, row, now):
    chosen = row.cause is not None and now.choices.reaction(row.cause) is Reaction.DISARM
    terminated = state is CommanderState.TERMINATED and event is Event.DISARM
    # "never flown" in the air cannot be: the commander sets `flown` with `landed` false.
    return now.landed or not now.flown or chosen or terminated


def test_every_row_of_the_table_is_reached():
    waiting = {id(row) for row in TABLE}
    for state, event in RULES:
        rows = RULES[state, event]
        for now in SITUATIONS:
            if waiting.isdisjoint(map(id, rows)):
                break
            waiting.discard(id(first_match(rows, now)))
    assert [row for row in TABLE if id(row) in waiting] == []


# What a healthy vehicle does in flight, with setpoints, sticks and a mission: where each request leads; "-"
# stays, "!" is refused. Asking for a mode is alike in all states that fly, so that is swept below.
#              ARM  DISARM   FORCE    TERMINATE
IN_FLIGHT = """
disarmed         hold -        -        -
manual           -    !        disarmed terminated
stabilized       -    !        disarmed terminated
acro             -    !        disarmed terminated
altitude         -    !        disarmed terminated
position         -    !        disarmed terminated
hold             -    !        disarmed terminated
takeoff          -    !        disarmed terminated
orbit            -    !        disarmed terminated
follow           -    !        disarmed terminated
mission          -    !        disarmed terminated
return           -    !        disarmed terminated
land             -    !        disarmed terminated
offboard         -    !        disarmed terminated
failsafe_hold    -    !        disarmed terminated
failsafe_return  -    !        disarmed terminated
failsafe_land    -    !        disarmed terminated
failsafe_descend -    !        disarmed terminated
terminated       -    disarmed disarmed -
"""
GOES_ON = {
    CommanderState.HOLD,
    CommanderState.LAND,
    CommanderState.RETURN,
    CommanderState.MISSION,
    CommanderState.OFFBOARD,
    CommanderState.MANUAL,
    CommanderState.STABILIZED,
    CommanderState.ACRO,
    CommanderState.ALTITUDE,
    CommanderState.POSITION,
}
MODES = [mode for mode in FlightMode if mode is not FlightMode.TERMINATION]


def _expected():
    rows = [line.split() for line in IN_FLIGHT.split("\n") if line]
    assert [row[0] for row in rows] == [state.value for state in CommanderState]
    return [
        (CommanderState(state), event, cell)
        for state, *cells in rows
        for event, cell in zip(ARMING, cells, strict=True)
    ]


@pytest.mark.parametrize(("state", "event", "cell"), _expected())
def test_commands_in_flight(state, event, cell):
    row = first_match(RULES[state, event], FLYING)
    assert row is not None
    assert row.result is (NO if cell == "!" else OK)
    assert row.target is (None if cell in "-!" else CommanderState(cell))


@pytest.mark.parametrize("state", CommanderState)
def test_every_mode_can_be_requested_in_every_state(state):
    for mode in MODES:
        row = first_match(RULES[state, mode], FLYING)
        assert row is not None, mode
        if state is CommanderState.TERMINATED:
            assert row.result is NO, mode
            continue
        assert (row.result, row.intends) == (OK, mode)
        own = CommanderState(mode.name.lower())
        stays = state is CommanderState.DISARMED or (state is own and own in GOES_ON)
        assert row.target is (None if stays else own), mode


@pytest.mark.parametrize("state", sorted(ARMED - {CommanderState.TERMINATED}, key=lambda state: state.value))
def test_a_mode_that_cannot_be_flown_is_refused_in_flight(state):
    blind = replace(FLYING, position_us=LONG_AGO, manual_us=NEVER_US, has_mission=False, setpoint_us=NEVER_US)
    for mode in MODES:
        row = first_match(RULES[state, mode], blind)
        assert row is not None, mode
        if mode is FlightMode.LAND:
            assert row.target in {CommanderState.FAILSAFE_DESCEND, CommanderState.LAND, None}
            assert row.result is OK
        elif state is CommanderState.OFFBOARD and mode is FlightMode.OFFBOARD:
            assert (row.result, row.target) == (OK, None)
        else:
            assert row.result is NO, mode
            assert row.text, mode


@pytest.mark.parametrize("state", CommanderState)
def test_nothing_changes_without_a_cause(state):
    assert first_match(RULES[state, Event.TICK], replace(FLYING)) is None


@pytest.mark.parametrize("state", sorted(ARMED - {CommanderState.TERMINATED}, key=lambda state: state.value))
def test_offboard_resumes_from_every_state_after_the_loss_of_setpoints(state):
    row = first_match(RULES[state, Event.TICK], replace(FLYING, cause=FailsafeCause.SETPOINTS))
    assert row is not None
    assert row.target is CommanderState.OFFBOARD


def test_nothing_resumes_after_termination():
    assert (
        first_match(
            RULES[CommanderState.TERMINATED, Event.TICK], replace(FLYING, cause=FailsafeCause.SETPOINTS)
        )
        is None
    )


REACTIONS = {
    Reaction.HOLD: CommanderState.FAILSAFE_HOLD,
    Reaction.RETURN: CommanderState.FAILSAFE_RETURN,
    Reaction.LAND: CommanderState.FAILSAFE_LAND,
    Reaction.TERMINATE: CommanderState.TERMINATED,
    Reaction.DISARM: CommanderState.DISARMED,
}
CHOSEN = [cause for cause in FailsafeCause if cause is not FailsafeCause.POSITION]
LATER = {FailsafeCause.GROUND_STATION, FailsafeCause.MANUAL}


@pytest.mark.parametrize("reaction", REACTIONS)
@pytest.mark.parametrize("cause", CHOSEN)
def test_every_cause_has_every_reaction(cause, reaction):
    now = replace(FLYING, choices=Choices({cause: reaction}))
    row = first_match(RULES[CommanderState.MISSION, cause], now)
    assert row is not None
    delayed = cause in LATER and reaction in {Reaction.RETURN, Reaction.LAND}
    assert row.target is (CommanderState.FAILSAFE_HOLD if delayed else REACTIONS[reaction])
    assert row.cause is cause
    assert cause.value in row.text
    assert row.follow_up is (
        reaction
        if delayed
        else Reaction.LAND
        if (cause, reaction) == (FailsafeCause.SETPOINTS, Reaction.HOLD)
        else Reaction.NOTHING
    )


@pytest.mark.parametrize(
    ("reaction", "state"),
    [
        (Reaction.POSITION, CommanderState.POSITION),
        (Reaction.ALTITUDE, CommanderState.ALTITUDE),
        (Reaction.STABILIZED, CommanderState.STABILIZED),
    ],
)
def test_lost_setpoints_give_control_to_a_pilot_with_sticks(reaction, state):
    choices = Choices({FailsafeCause.SETPOINTS: reaction}, without_sticks=Reaction.LAND)
    row = first_match(
        RULES[CommanderState.OFFBOARD, FailsafeCause.SETPOINTS], replace(FLYING, choices=choices)
    )
    assert row is not None
    assert row.target is state
    alone = replace(FLYING, choices=choices, manual_us=NEVER_US)
    row = first_match(RULES[CommanderState.OFFBOARD, FailsafeCause.SETPOINTS], alone)
    assert row is not None
    assert row.target is CommanderState.FAILSAFE_LAND


def test_only_arming_arms_and_only_when_checks_pass():
    for event, now in product((Event.TICK, *COMMANDS), SITUATIONS):
        row = first_match(RULES[CommanderState.DISARMED, event], now)
        if row is not None and row.target in ARMED:
            assert event is Event.ARM
            assert not when.unsettled(now)
            assert not when.tipped_over(now)
            assert now.intended not in when.UNARMABLE
            assert now.intended is not FlightMode.OFFBOARD or now.setpoint_us == NOW
            assert now.intended not in when.MANUAL_MODES or now.manual_us == NOW
            assert now.intended is not FlightMode.MISSION or now.has_mission
            assert FLOWN_MODE[row.target] is now.intended


@pytest.mark.parametrize("state", sorted(ARMED - {CommanderState.TERMINATED}, key=lambda state: state.value))
def test_failsafes_come_first(state):
    for now in SITUATIONS:
        row = first_match(RULES[state, Event.TICK], now)
        if when.sensors_lost(now):
            assert row is not None
            assert row.target is (CommanderState.DISARMED if now.landed else CommanderState.TERMINATED)
        elif when.tumbled(now):
            assert row is not None
            assert row.target is CommanderState.TERMINATED


@pytest.mark.parametrize(
    "state",
    sorted(ARMED - {CommanderState.OFFBOARD, CommanderState.TERMINATED}, key=lambda state: state.value),
)
def test_offboard_is_entered_only_with_setpoints(state):
    row = first_match(RULES[state, FlightMode.OFFBOARD], replace(FLYING, setpoint_us=NEVER_US))
    assert row is not None
    assert row.result is NO
    assert row.text == "Switching to Offboard is currently not available"


@pytest.mark.parametrize(
    ("state", "change", "target", "text"),
    [
        (
            CommanderState.HOLD,
            {"usable_us": NOW - 300_001},
            CommanderState.TERMINATED,
            "Sensors lost: flight terminated",
        ),
        (
            CommanderState.HOLD,
            {"usable_us": NOW - 300_001, "landed": True},
            CommanderState.DISARMED,
            "Sensors lost: motors stopped",
        ),
        (CommanderState.HOLD, {"usable_us": NOW - 300_000}, None, ""),
        (
            CommanderState.LAND,
            {"upright_us": NOW - 300_001},
            CommanderState.TERMINATED,
            "Attitude failure: flight terminated",
        ),
        (CommanderState.LAND, {"upright_us": NOW - 300_000}, None, ""),
        (
            CommanderState.HOLD,
            {"landed": True, "airborne_us": NOW - 2_000_000},
            CommanderState.DISARMED,
            "Disarmed by landing",
        ),
        (CommanderState.HOLD, {"landed": True, "airborne_us": NOW - 1_999_999}, None, ""),
        (
            CommanderState.HOLD,
            {"landed": True, "flown": False, "airborne_us": NEVER_US, "armed_us": NOW - 10_000_000},
            CommanderState.DISARMED,
            "Disarmed by auto preflight disarming",
        ),
        (
            CommanderState.LAND,
            {
                "landed": True,
                "flown": False,
                "airborne_us": NEVER_US,
                "armed_us": NOW,
                "entered_us": LONG_AGO,
            },
            CommanderState.DISARMED,
            "Disarmed by landing",
        ),
        (CommanderState.OFFBOARD, {"setpoint_us": NEVER_US}, None, ""),  # told by an event, not by the tick
        (CommanderState.FAILSAFE_HOLD, {"entered_us": NOW - 4_999_999, "follow_up": Reaction.LAND}, None, ""),
        (
            CommanderState.FAILSAFE_HOLD,
            {"entered_us": NOW - 5_000_000, "follow_up": Reaction.LAND},
            CommanderState.FAILSAFE_LAND,
            "Failsafe: landing",
        ),
        (
            CommanderState.FAILSAFE_HOLD,
            {"entered_us": NOW - 5_000_000, "follow_up": Reaction.RETURN},
            CommanderState.FAILSAFE_RETURN,
            "Failsafe: returning home",
        ),
        (CommanderState.FAILSAFE_HOLD, {"entered_us": LONG_AGO}, None, ""),  # hold was chosen for good
        (
            CommanderState.FAILSAFE_HOLD,
            {"entered_us": NOW - 5_000_000, "landed": True, "follow_up": Reaction.LAND},
            CommanderState.DISARMED,
            "Disarmed by failsafe",
        ),
        (CommanderState.TAKEOFF, {"target_reached": True}, CommanderState.HOLD, ""),
    ],
)
def test_what_a_tick_does(state, change, target, text):
    row = first_match(RULES[state, Event.TICK], replace(FLYING, **change))
    assert (row.target if row else None) is target
    assert (row.text if row else "") == text


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"unusable_us": NOW - 700_000}, "Arming denied: Resolve system health failures first"),
        ({"upright_us": NOW - 4000}, "Arming denied: vehicle is tipped over"),
        ({"position_us": LONG_AGO}, "Arming denied: no position estimate"),
        ({"battery_arms": False}, "Arming denied: low battery"),
        ({"choices": CHOICES[1]}, "Arming denied: no connection to the ground station"),
        ({"intended": FlightMode.LAND}, "Arming denied: not in this mode"),
        (
            {"intended": FlightMode.POSITION, "manual_us": NEVER_US},
            "Arming denied: no manual control input",
        ),
        ({"intended": FlightMode.MISSION, "has_mission": False}, "Arming denied: no valid mission"),
        (
            {"intended": FlightMode.OFFBOARD, "setpoint_us": NEVER_US},
            "Arming denied: no offboard setpoints",
        ),
    ],
)
def test_why_arming_is_denied(change, text):
    row = first_match(RULES[CommanderState.DISARMED, Event.ARM], replace(STANDING, **change))
    assert row is not None
    assert (row.result, row.text) == (NO, text)


def test_arming_is_denied_in_the_words_of_the_estimators_condition():
    commander = Commander()
    commander.situation = replace(STANDING, problem="barometer is stuck")
    assert commander.refusal == "Arming denied: barometer is stuck"
    row = commander.handle(Event.ARM)
    assert (row.result, row.text) == (NO, "Arming denied: barometer is stuck")
    commander.situation.problem = "GPS fix too low"
    assert commander.refusal == "Arming denied: GPS fix too low"
    commander.situation.intended = FlightMode.STABILIZED  # needs no position
    commander.situation.manual_us = commander.situation.now_us
    assert commander.refusal == ""


def test_disarming_on_the_ground():
    for state in ARMED:
        row = first_match(RULES[state, Event.DISARM], STANDING)
        assert row is not None
        assert (row.result, row.target, row.intends) == (OK, CommanderState.DISARMED, FlightMode.HOLD)


@pytest.mark.parametrize("wait", [-1.0, 0.0])
def test_automatic_disarming_can_be_turned_off(wait):
    commander = Commander()
    commander.configure(Parameters({"COM_DISARM_LAND": wait, "COM_DISARM_PRFLT": wait}))
    now = replace(STANDING, armed_us=LONG_AGO, airborne_us=LONG_AGO, timeouts=commander.situation.timeouts)
    for flown, state in product((False, True), (CommanderState.HOLD, CommanderState.LAND)):
        assert first_match(RULES[state, Event.TICK], replace(now, flown=flown)) is None


def test_parameters_set_times_and_choices():
    commander = Commander()
    commander.configure(
        Parameters({"COM_OF_LOSS_T": 0.5, "COM_FAIL_ACT_T": 3.0, "COM_OBL_RC_ACT": 4, "NAV_DLL_ACT": 2})
    )
    assert commander.situation.timeouts == Timeouts(setpoint_loss_us=500_000, failsafe_hold_us=3_000_000)
    choices = commander.situation.choices
    assert choices.reactions[FailsafeCause.SETPOINTS] is Reaction.LAND
    assert choices.reactions[FailsafeCause.GROUND_STATION] is Reaction.RETURN
    assert choices.reactions[FailsafeCause.FENCE] is Reaction.HOLD  # PX4's default
    assert choices.arm_needs_ground_station


def test_defaults_return_home_when_setpoints_stop_without_manual_control():
    commander = Commander()
    commander.configure(Parameters())
    assert commander.situation.choices.reaction(FailsafeCause.SETPOINTS) is Reaction.RETURN


def _flying_commander():
    commander = Commander()
    commander.configure(Parameters())
    now_us = _ticks(commander, 0, 300)
    commander.handle(Event.ARM)
    return commander, _ticks(commander, now_us, 10, landed=False)


def _until(commander, now_us, condition, limit_s=30, **conditions):
    """Time until something happens, s."""
    start_us = now_us
    while not condition():
        assert now_us - start_us < limit_s * 1e6, "it never happened"
        now_us = _ticks(commander, now_us, 1, landed=False, **conditions)
    return (now_us - start_us) / 1e6


def test_a_lost_ground_station_holds_and_then_returns_with_px4s_timing():
    commander, now_us = _flying_commander()
    commander.configure(Parameters({"NAV_DLL_ACT": 2}))
    commander.note_ground_station()
    held_s = _until(commander, now_us, lambda: commander.state is CommanderState.FAILSAFE_HOLD)
    assert held_s == pytest.approx(12.28, abs=0.06)
    assert commander.failsafe
    now_us += round(held_s * 1e6)
    returned_s = _until(commander, now_us, lambda: commander.state is CommanderState.FAILSAFE_RETURN)
    assert returned_s == pytest.approx(5.0, abs=0.02)
    commander.note_ground_station()  # it does not come back by itself
    _ticks(commander, now_us + 5_100_000, 100, landed=False)
    assert commander.state is CommanderState.FAILSAFE_RETURN


def test_a_failsafe_that_was_overridden_acts_again_only_after_its_cause_has_ended():
    commander, now_us = _flying_commander()
    commander.configure(Parameters({"NAV_DLL_ACT": 2, "COM_DL_LOSS_T": 5}))
    commander.note_ground_station()
    _until(commander, now_us, lambda: commander.state is CommanderState.FAILSAFE_HOLD)
    commander.handle(FlightMode.HOLD)
    now_us = _ticks(commander, commander.situation.now_us + 4000, 500, landed=False)
    assert commander.state is CommanderState.HOLD
    commander.note_ground_station()
    _until(commander, now_us, lambda: commander.state is CommanderState.FAILSAFE_HOLD)


@pytest.mark.parametrize(
    ("level", "state"),
    [(2, CommanderState.HOLD), (3, CommanderState.FAILSAFE_RETURN), (4, CommanderState.FAILSAFE_LAND)],
)
def test_a_discharging_battery_warns_returns_and_lands(level, state):
    commander, now_us = _flying_commander()
    for warning in range(1, level + 1):
        commander.situation.battery_warning = warning
        now_us = _ticks(commander, now_us, 30, landed=False)
    assert commander.state is state


def test_sticks_that_stop_in_a_manual_mode_hold_and_then_return():
    commander, now_us = _flying_commander()
    commander.note_manual_input()
    commander.handle(FlightMode.POSITION)
    lost_s = _until(commander, now_us, lambda: commander.state is CommanderState.FAILSAFE_HOLD)
    assert lost_s == pytest.approx(0.5, abs=0.05)
    now_us += round(lost_s * 1e6)
    assert _until(
        commander, now_us, lambda: commander.state is CommanderState.FAILSAFE_RETURN
    ) == pytest.approx(5, abs=0.02)


def test_sticks_that_were_missing_at_arming_are_not_lost():
    commander, now_us = _flying_commander()
    _ticks(commander, now_us, 1000, landed=False)
    assert commander.state is CommanderState.HOLD


def test_a_lost_position_descends():
    commander, now_us = _flying_commander()
    lost_s = _until(
        commander, now_us, lambda: commander.state is CommanderState.FAILSAFE_DESCEND, has_position=False
    )
    assert lost_s == pytest.approx(1.0, abs=0.05)


def test_a_geofence_breach_holds():
    commander, now_us = _flying_commander()
    commander.situation.fence_breached = True
    _until(commander, now_us, lambda: commander.state is CommanderState.FAILSAFE_HOLD, limit_s=0.1)
    commander.handle(Event.FORCE_DISARM)
    now_us = _ticks(commander, commander.situation.now_us + 4000, 300)
    commander.handle(Event.ARM)  # it is reacted to again in the next flight
    _until(commander, now_us, lambda: commander.state is CommanderState.FAILSAFE_HOLD, limit_s=0.1)


def _ticks(commander, start_us, count, **conditions):
    seen = Observation(0, usable=True, has_position=True, upright=True, landed=True, target_reached=False)
    for tick in range(count):
        commander.tick(seen._replace(now_us=start_us + 4000 * tick, **conditions))
    return start_us + 4000 * count


def test_ready_after_usable_samples_for_the_settling_time():
    for first_us in (0, 3_000_000):
        commander = Commander()
        now_us = _ticks(commander, first_us, 200)
        assert commander.refusal
        _ticks(commander, now_us, 1)
        assert not commander.refusal


def test_one_unusable_sample_restarts_the_settling_time():
    commander = Commander()
    now_us = _ticks(commander, 0, 300)
    assert not commander.refusal
    now_us = _ticks(commander, now_us, 1, usable=False)
    assert commander.refusal
    _ticks(commander, now_us, 201)
    assert not commander.refusal


def test_a_setpoint_from_the_future_does_not_stay_fresh_for_ever():
    commander = Commander()
    now_us = _ticks(commander, 0, 300)
    commander.note_setpoint(10**12)
    assert not when.setpoint_lost(commander.situation)
    _ticks(commander, now_us, 300)
    assert when.setpoint_lost(commander.situation)
