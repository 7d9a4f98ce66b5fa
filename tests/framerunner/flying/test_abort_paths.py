"""Every way in which a real drone's flight is aborted, flown with the app's adapter in simulated time.

The vehicle has the failsafe parameters that the checks before arming demand.
"""

import asyncio
from math import hypot
from random import Random

import pytest
from mavsdk.exceptions import MavsdkError

from firmware_py.status import FlightMode
from framerunner.flying.plan import FlightPlan
from framerunner.preflight.keys import KeyReader
from framerunner.wire.operator_messages import PageMessage
from offboard.limits import Caps
from offboard.mission import load_mission
from offboard.pilot import Pilot
from offboard.safety.failsafes import failsafe_rows
from offboard.safety.fence import flight_fence
from offboard.safety.operator import Operator
from offboard.safety.operator_pages import OperatorPages
from offboard.safety.rules import SafetyRules
from scenarios.faults.declaration import parse_fault
from scenarios.loader import load_scenario
from tests.framerunner.simulated_link import Direction, Impairment, fly_over
from tests.offboard.fakes import runaway

GOOD = Impairment()
SILENT = Impairment(silent_s=(0.0, 1e9))
UP = (0, 0, 0.2)
ALOFT_S = 6.0  # when it has flown for three seconds and still rises, a metre above its base


def hall(fault=None, limit_s=30.0, sensors="ideal"):
    faults = () if fault is None else (parse_fault(fault),)
    update = {"frames": (), "try_limit_s": limit_s, "faults": faults, "sensors": sensors}
    return load_scenario("test-case-1").model_copy(update=update)


def demanded_parameters(scenario):
    plan = FlightPlan(scenario)
    fence = flight_fence(plan.box, plan.start_pose[:3])
    return {row.name: row.wanted(fence) for row in failsafe_rows()}


def fly(
    tmp_path,
    *,
    scenario=None,
    operator=None,
    mission=None,
    events=(),
    impairment=GOOD,
    caps=None,
    after_s=40.0,
    **changed,
):
    """A flight as with --drone, which rises slowly for ever; all is followed until the drone is down."""
    scenario = scenario or hall()
    operator = operator or Operator(needs_go=False)
    return fly_over(
        impairment,
        scenario,
        mission or runaway(tmp_path, UP),
        safety=SafetyRules("land", operator),
        caps=caps or Caps(),
        events=events,
        parameters=demanded_parameters(scenario) | changed,
        after_s=after_s,
    )


def came_down(flight):
    """Whether it is disarmed, on the ground, and never fell."""
    fastest_m_s = min(truth.velocity_arena_m_s[2] for truth in flight.truths)
    return not flight.armed and flight.truths[-1].position_arena_m[2] < 0.6 and fastest_m_s > -2.0


def modes(flight):
    return [moment.state.mode for moment in flight.moments]


def test_the_operators_stop_lands(tmp_path):
    operator = Operator(needs_go=False)
    flight = fly(tmp_path, operator=operator, events=[(ALOFT_S, lambda _: operator.demand_landing())])
    assert flight.outcome.reason == "stopped by the operator"
    assert came_down(flight)
    assert flight.truths[-1].time_us < 15e6  # as requested, not when it meets its fence
    assert 2.0 < flight.outcome.flight_time_s < 4.0


def test_the_second_stop_stops_the_motors_during_the_landing(tmp_path):
    operator = Operator(needs_go=False)
    events = [(ALOFT_S, lambda _: operator.demand_landing()), (7.0, lambda _: operator.demand_motors_off())]
    flight = fly(tmp_path, operator=operator, events=events)
    assert flight.outcome.reason == "stopped by the operator; the operator stopped the motors"
    assert not flight.armed
    off_s = next(each.time_us for each in flight.truths if each.time_us > 6e6 and not each.motors_on) / 1e6
    assert off_s == pytest.approx(7.0, abs=0.05)


def test_both_stops_at_once_stop_the_motors(tmp_path):
    operator = Operator(needs_go=False)
    events = [(ALOFT_S, lambda _: (operator.demand_landing(), operator.demand_motors_off()))]
    flight = fly(tmp_path, operator=operator, events=events)
    off_s = next(each.time_us for each in flight.truths if each.time_us > 5e6 and not each.motors_on) / 1e6
    assert off_s == pytest.approx(ALOFT_S, abs=0.1)


def test_a_stop_arrives_over_a_lossy_link(tmp_path):
    operator = Operator(needs_go=False)
    lossy = Impairment(loss=0.2, jitter_s=0.2)
    events = [(ALOFT_S, lambda _: operator.demand_landing())]
    flight = fly(tmp_path, operator=operator, impairment=lossy, events=events)
    assert flight.outcome.reason.startswith("stopped by the operator")
    assert came_down(flight)


def test_a_landing_whose_answer_is_lost_is_not_ended_by_hold(tmp_path):
    operator = Operator(needs_go=False)

    def lose_answers(vehicle):
        async def command(act):
            vehicle.up.send(vehicle.time_us, act)
            await asyncio.sleep(0.1)
            raise MavsdkError("TIMEOUT")

        vehicle.command = command

    events = [(5.9, lose_answers), (ALOFT_S, lambda _: operator.demand_landing())]
    flight = fly(tmp_path, operator=operator, events=events)
    assert flight.outcome.reason == "stopped by the operator"
    assert came_down(flight)


@pytest.mark.parametrize("abort", ["stop", "camera"])
def test_a_landing_that_is_lost_is_requested_again(tmp_path, abort):
    operator, lost = Operator(needs_go=False), []

    def lose_landings(vehicle):
        command = vehicle.command

        async def lossy(act):
            if act == vehicle.autopilot.land and len(lost) < 2:
                lost.append(vehicle.time_us)
                raise MavsdkError("TIMEOUT")
            await command(act)

        vehicle.command = lossy

    def end(vehicle):
        if abort == "stop":
            operator.demand_landing()
        else:
            vehicle.video = Direction(SILENT, Random(0))

    flight = fly(tmp_path, operator=operator, events=[(5.9, lose_landings), (ALOFT_S, end)])
    assert len(lost) == 2
    assert flight.outcome.reason.endswith("hold was requested instead; it landed later")
    assert came_down(flight)


def test_a_vehicle_that_others_arm_before_the_go_is_left_to_them(tmp_path):
    operator = Operator()
    events = [(4.0, lambda vehicle: vehicle.autopilot.arm()), (7.0, lambda _: operator.give_go())]
    flight = fly(tmp_path, operator=operator, events=events, after_s=1.0)
    assert "armed by others while it waited for the go" in flight.outcome.reason
    assert flight.outcome.flight_time_s == 0.0
    assert "OFFBOARD" not in modes(flight)


def test_a_go_before_it_is_asked_for_does_not_count(tmp_path, monkeypatch):
    monkeypatch.setattr("offboard.app.GO_LIMIT_US", 5_000_000)
    operator = Operator()
    flight = fly(tmp_path, operator=operator, events=[(0.1, lambda _: operator.give_go())])
    assert flight.outcome.reason.startswith("no go within")
    assert not any(truth.motors_on for truth in flight.truths)


def test_nothing_is_armed_before_the_go(tmp_path):
    operator = Operator(hint="hold G")
    events = [(7.0, lambda _: operator.give_go())]
    flight = fly(tmp_path, operator=operator, events=events, scenario=hall(limit_s=3.0), after_s=1.0)
    first_s = next(truth.time_us for truth in flight.truths if truth.motors_on) / 1e6
    assert first_s > 7.0
    assert "waiting for the operator's go: hold G" in {moment.remark for moment in flight.moments}
    assert flight.outcome.ended == "timed out"


def test_a_stop_before_the_go_arms_nothing(tmp_path):
    operator = Operator()

    def stop(_):
        assert operator.asks
        operator.demand_landing()
        operator.give_go()

    flight = fly(tmp_path, operator=operator, events=[(4.0, stop)])
    assert (flight.outcome.ended, flight.outcome.reason) == ("aborted", "stopped by the operator")
    assert not operator.has_go
    assert not any(truth.motors_on for truth in flight.truths)


def test_a_go_that_does_not_come_ends_the_wait(tmp_path, monkeypatch):
    monkeypatch.setattr("offboard.app.GO_LIMIT_US", 5_000_000)
    flight = fly(tmp_path, operator=Operator())
    assert flight.outcome.reason.startswith("no go within")
    assert not any(truth.motors_on for truth in flight.truths)


def test_a_lost_link_leaves_the_landing_to_the_vehicle(tmp_path):
    flight = fly(tmp_path, impairment=Impairment(silent_s=(ALOFT_S, 1e9)))
    assert flight.outcome.reason.startswith("link lost")
    assert came_down(flight)
    assert modes(flight)[-1] == "OFFBOARD"  # the app has seen nothing of it


def test_an_app_that_is_gone_leaves_the_landing_to_the_vehicle(tmp_path):
    """As after `kill -9`: setpoints end at once, and nothing else is sent."""

    def kill(vehicle):
        vehicle.up = vehicle.beats = Direction(SILENT, Random(0))

    flight = fly(tmp_path, events=[(ALOFT_S, kill)])
    assert came_down(flight)
    assert flight.outcome.reason.startswith("the pilot or a failsafe took over: mode LAND")


def test_a_low_battery_lands(tmp_path):
    flight = fly(tmp_path, scenario=hall("battery sag 0.2 at 3 s", sensors="mocap"))
    assert flight.outcome.reason.startswith("the pilot or a failsafe took over: mode LAND")
    assert came_down(flight)


def test_a_camera_that_is_lost_lands(tmp_path):
    def cover(vehicle):
        vehicle.video = Direction(SILENT, Random(0))

    flight = fly(tmp_path, events=[(ALOFT_S, cover)])
    assert flight.outcome.reason.startswith("the camera is dead: no image for 1.")
    assert came_down(flight)


def test_an_estimator_without_a_position_descends(tmp_path):
    flight = fly(tmp_path, scenario=hall("external_pose off at 3 s", sensors="mocap"))  # after arming
    heights_m = [truth.position_arena_m[2] for truth in flight.truths]
    assert max(heights_m) > heights_m[0] + 0.5
    assert flight.outcome.ended == "aborted"
    assert came_down(flight)


def test_a_fence_that_is_breached_lands(tmp_path):
    """The vehicle's fence is within the app's box here, as if the box failed."""
    away = runaway(tmp_path, (0.8, 0, 0))
    flight = fly(tmp_path, mission=away, GF_MAX_HOR_DIST=3.0, GF_ACTION=5)
    assert flight.outcome.reason.startswith("the pilot or a failsafe took over: mode LAND")
    assert came_down(flight)
    assert max(hypot(x + 3, y + 3) for x, y, _ in (t.position_arena_m for t in flight.truths)) < 4.5


def test_caps_hold_whatever_a_mission_asks(tmp_path, caplog):
    caps = Caps(level_m_s=0.5, vertical_m_s=0.4, height_m=1.5)
    away = runaway(tmp_path, (1, 1, 1))
    flight = fly(tmp_path, mission=away, caps=caps, scenario=hall(limit_s=8.0))
    start_z = flight.truths[0].position_arena_m[2]
    level = max(hypot(*truth.velocity_arena_m_s[:2]) for truth in flight.truths)
    assert level < 0.6
    assert max(truth.velocity_arena_m_s[2] for truth in flight.truths) < 0.5
    assert max(truth.position_arena_m[2] for truth in flight.truths) < start_z + 1.55
    assert flight.outcome.ended == "timed out"
    said = [record.message for record in caplog.records if record.message.startswith("cap on")]
    assert sorted(line.partition(":")[0] for line in said) == ["cap on level speed", "cap on vertical speed"]
    assert came_down(flight)


class Broken(Pilot):
    """Fails in flight."""

    def fail(self) -> None:
        """Break."""
        raise ZeroDivisionError("no reason")


def test_a_mission_error_lands(tmp_path):
    path = tmp_path / "broken.yaml"
    path.write_text(
        "name: broken\ninitial: up\nstates:\n  up:\n    enter: [hover, cmd.vel_z = 0.4]\n    transitions:\n"
        "      - {when: seconds_in_state > 2, to: fails}\n  fails:\n    enter: [fail]\n    transitions:\n"
        "      - {when: seconds_in_state > 2, to: done}\n  done:\n    final: true\n",
        encoding="utf-8",
    )
    flight = fly(tmp_path, mission=load_mission(str(path), Broken))
    assert "ZeroDivisionError: no reason" in flight.outcome.reason
    assert came_down(flight)


def test_the_time_limit_lands(tmp_path):
    flight = fly(tmp_path, scenario=hall(limit_s=3.0))
    assert flight.outcome.reason == "not finished within 3 s"
    assert came_down(flight)


def test_ctrl_c_lands(tmp_path):
    events = [(ALOFT_S, lambda vehicle: vehicle.app.cancel())]
    flight = fly(tmp_path, events=events)
    assert flight.outcome.interrupted
    assert came_down(flight)


def hold(tmp_path, operator=None, events=(), impairment=GOOD, scenario=None, hold_s=4.0, **changed):
    """A flight that holds when its time is over, at 6 s."""
    scenario = scenario or hall(limit_s=3.0)
    return fly_over(
        impairment,
        scenario,
        runaway(tmp_path, UP),
        safety=SafetyRules("hold", operator or Operator(needs_go=False), hold_s),
        caps=Caps(),
        events=events,
        parameters=demanded_parameters(scenario) | changed,
        after_s=60.0,
    )


def seconds_in(flight, mode):
    return sum(moment.state.mode == mode for moment in flight.moments) / 20


def test_a_drone_that_holds_lands_after_its_time(tmp_path):
    flight = hold(tmp_path)
    assert flight.outcome.reason == "not finished within 3 s; it held for 4 s, then landed"
    assert seconds_in(flight, "HOLD") == pytest.approx(4.0, abs=0.5)
    assert came_down(flight)


def test_a_stop_lands_a_drone_that_holds(tmp_path):
    operator = Operator(needs_go=False)
    flight = hold(tmp_path, operator, [(9.0, lambda _: operator.demand_landing())], hold_s=30.0)
    assert came_down(flight)
    assert 1.0 < seconds_in(flight, "HOLD") < 5.0


def test_a_low_battery_lands_a_drone_that_holds(tmp_path):
    flight = hold(
        tmp_path, scenario=hall("battery sag 0.2 at 6 s", limit_s=3.0, sensors="mocap"), hold_s=60.0
    )
    assert came_down(flight)
    assert seconds_in(flight, "HOLD") < 8.0
    assert "it held" not in flight.outcome.reason


@pytest.mark.parametrize("end", ["link lost", "app killed"])
def test_a_drone_that_holds_lands_by_itself_without_the_app(tmp_path, end):
    def cut(vehicle):
        vehicle.up = vehicle.beats = Direction(SILENT, Random(0))
        if end == "link lost":
            vehicle.down = Direction(SILENT, Random(0))

    flight = hold(tmp_path, events=[(9.0, cut)], hold_s=60.0)
    assert came_down(flight)


def test_others_keep_a_drone_that_held(tmp_path):
    def take(vehicle):
        vehicle.autopilot.set_mode(FlightMode.LAND)  # as by a remote control

    flight = hold(tmp_path, events=[(8.0, take)])
    assert came_down(flight)
    assert "it held" not in flight.outcome.reason


@pytest.mark.parametrize("seconds", [2.0, 5.0])
def test_an_app_that_hangs_stands_and_then_lands(tmp_path, seconds):
    events = [(ALOFT_S, lambda vehicle: vehicle.hang(seconds))]
    flight = fly(tmp_path, events=events, scenario=hall(limit_s=7.0))
    if seconds < 3.0:
        assert flight.outcome.ended == "timed out"
    else:
        assert flight.outcome.reason == "this app hung for more than 3.0 s; its watchdog requested landing"
    hung = [truth for truth in flight.truths if 7.5e6 < truth.time_us < 8.0e6]
    assert max(abs(truth.velocity_arena_m_s[2]) for truth in hung) < 0.1  # it stands
    assert came_down(flight)


def test_an_app_that_hangs_for_good_lands(tmp_path):
    flight = fly(tmp_path, events=[(ALOFT_S, lambda vehicle: vehicle.hang(12.0))])
    down_s = next(t.time_us for t in flight.truths if t.time_us > 6e6 and not t.motors_on) / 1e6
    assert down_s < 18.0  # while it hangs
    assert came_down(flight)


def test_an_app_that_is_stopped_and_continued_leaves_the_landing_to_the_vehicle(tmp_path):
    """As SIGSTOP and SIGCONT: nothing is sent for five seconds, then the app finds the drone landing."""

    def stop(vehicle):
        up, beats, watchdog = vehicle.up, vehicle.beats, vehicle.watchdog
        vehicle.up = vehicle.beats = Direction(SILENT, Random(0))
        vehicle.watchdog = None  # its thread is stopped, too
        vehicle.hang(5.0)
        vehicle.up, vehicle.beats, vehicle.watchdog = up, beats, watchdog
        watchdog.beat(vehicle.time_s())

    flight = fly(tmp_path, events=[(ALOFT_S, stop)])
    assert flight.outcome.reason.startswith("the pilot or a failsafe took over: mode LAND")
    assert came_down(flight)


def test_an_app_that_goes_on_after_a_long_stop_requests_nothing_of_a_drone_that_others_have(
    tmp_path, monkeypatch
):
    """What it knew before is old: the drone has begun to land by itself, and others have taken it since."""
    monkeypatch.setattr("offboard.abort.ATTEND_US", 4_000_000)

    def stop(vehicle):
        directions, watchdog = (vehicle.up, vehicle.beats, vehicle.down), vehicle.watchdog
        vehicle.up = vehicle.beats = vehicle.down = Direction(SILENT, Random(0))
        vehicle.watchdog = None
        vehicle.hang(2.0)
        vehicle.autopilot.set_mode(FlightMode.HOLD)
        vehicle.hang(2.0)
        vehicle.up, vehicle.beats, vehicle.down = directions
        vehicle.watchdog, watchdog.stood_still = watchdog, True
        watchdog.check(vehicle.time_s())

    flight = fly(tmp_path, events=[(ALOFT_S, stop)], after_s=1.0)
    assert flight.outcome.reason.startswith("this app was stopped for 4.")
    after = [moment.state for moment in flight.moments if moment.state.time_us > 11_100_000]
    assert {(state.mode, state.armed) for state in after} == {("HOLD", True)}


def test_hold_on_abort_holds_without_an_operator(tmp_path):
    scenario = hall(limit_s=3.0)
    safety = SafetyRules("hold")
    flight = fly_over(GOOD, scenario, runaway(tmp_path, UP), safety=safety, caps=Caps(), after_s=10.0)
    assert (flight.mode, flight.armed) == (FlightMode.HOLD, True)


FLIGHT = "test-case-1 7"


class PageHand:
    """An operator's page beside a flight, in the flight's time: events for `fly`."""

    def __init__(self, *, alone=True):
        self.operator = Operator(hint="hold Go on the page")
        self.pages = OperatorPages(self.operator, FLIGHT, alone=alone)
        self.beat = -1

    def events(self, script, to_s=16.0):
        """What the page says, ten times a second.

        Args:
            script: from a time in seconds on: `here`, `go`, `stop`, `stop_motors`, or None: it is lost.
            to_s: end of the events, until which all is followed.
        """
        times = [step / 10 for step in range(round(to_s * 10))]
        return [
            (at_s, self._event([what for from_s, what in script if from_s <= at_s][-1])) for at_s in times
        ]

    def _event(self, what):
        def happen(vehicle):
            now_s = vehicle.time_s()
            self.pages.check(now_s)
            if what is not None:
                self.beat = self.pages.beat(now_s)
                for each in ("here", what):
                    message = PageMessage(page=1, name="Ada", what=each, beat=self.beat, flight=FLIGHT)
                    self.pages.take(message, now_s)

        return happen


def test_a_page_gives_the_go_and_lands(tmp_path):
    page = PageHand()
    script = [(0.0, "here"), (4.0, "go"), (5.5, "here"), (13.0, "stop"), (13.5, "here")]
    flight = fly(tmp_path, operator=page.operator, events=page.events(script))
    on_s = next(truth.time_us for truth in flight.truths if truth.motors_on) / 1e6
    assert 5.0 < on_s < 8.0
    assert flight.outcome.reason == "stopped by the operator (Ada, on the page)"
    assert came_down(flight)


def test_the_pages_second_control_stops_the_motors(tmp_path):
    page = PageHand()
    script = [(0.0, "here"), (4.0, "go"), (5.5, "here"), (10.0, "stop"), (11.0, "stop_motors")]
    flight = fly(tmp_path, operator=page.operator, events=page.events(script, 12.0))
    assert flight.outcome.reason.endswith("(Ada, on the page); the operator stopped the motors")
    off_s = max(truth.time_us for truth in flight.truths if truth.motors_on) / 1e6
    assert off_s == pytest.approx(11.0, abs=0.1)


def test_a_page_that_is_lost_before_the_go_arms_nothing(tmp_path, monkeypatch):
    monkeypatch.setattr("offboard.app.GO_LIMIT_US", 6_000_000)
    page = PageHand()
    script = [(0.0, "here"), (4.0, "go"), (4.9, None)]
    flight = fly(tmp_path, operator=page.operator, events=page.events(script, 9.0))
    assert flight.outcome.reason.startswith("no go within")
    assert not any(truth.motors_on for truth in flight.truths)


def test_a_page_that_is_lost_in_flight_without_a_terminal_lands(tmp_path):
    page = PageHand()
    script = [(0.0, "here"), (4.0, "go"), (5.5, "here"), (9.0, None)]
    flight = fly(tmp_path, operator=page.operator, events=page.events(script))
    assert flight.outcome.reason == "stopped by the operator (no operator's page was connected)"
    assert came_down(flight)


def test_the_terminal_stops_what_the_page_has_armed(tmp_path):
    page = PageHand(alone=False)
    keys = KeyReader(page.operator)
    script = [(0.0, "here"), (4.0, "go"), (5.5, None)]
    events = [*page.events(script), (13.0, lambda vehicle: keys.take(" ", vehicle.time_s()))]
    flight = fly(tmp_path, operator=page.operator, events=sorted(events, key=lambda each: each[0]))
    assert flight.outcome.reason == "stopped by the operator"
    assert came_down(flight)
