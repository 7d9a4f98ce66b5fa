import json
from itertools import pairwise
from math import nan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenarios.models import Gate, Scenario, TrueState
from scenarios.referee import Referee
from scenarios.verdict import Verdict

ENVELOPE = (0.25, 0.25, 0.045)
HOME = (0.0, 0.0, 0.5325)
LEVEL = (1.0, 0.0, 0.0, 0.0)
GATES = (  # listed in another order than their turns; all planes are crossed along x
    Gate(colour="blue", x_m=3, y_m=0, z_m=1),
    Gate(colour="red", x_m=1, y_m=0, z_m=1),
    Gate(colour="green", x_m=2, y_m=0, z_m=1, yaw_rad=3.14159265),
)
COURSE = Scenario(name="course", frames=GATES, try_limit_s=60)
EMPTY = Scenario(name="empty")
UP = (0.0, 0.0, 1.0)
OUT = (4.0, 0.0, 1.0)
LAP = [UP, OUT, (4.0, 0.0, 2.0), (0.0, 0.0, 2.0), (0.0, 0.0, 0.6)]


class Flight:
    """Feeds a referee with a drone that flies straight from point to point."""

    def __init__(self, scenario=COURSE, speed_m_s=1.0, step_us=20_000):
        self.referee = Referee(scenario, ENVELOPE)
        self.speed_m_s, self.step_us = speed_m_s, step_us
        self.time_us, self.position, self.motors_on = 0, HOME, False
        self.state()

    def state(self, velocity=(0.0, 0.0, 0.0), contacts=(), attitude=LEVEL):
        self.referee.update(
            TrueState(self.time_us, self.position, velocity, attitude, self.motors_on, tuple(contacts))
        )
        return self

    def wait(self, seconds, **kwargs):
        for _ in range(round(seconds * 1e6 / self.step_us)):
            self.time_us += self.step_us
            self.state(**kwargs)
        return self

    def motors(self, on):
        self.motors_on = on
        self.time_us += self.step_us
        return self.state()

    def fly(self, *points, contacts=()):
        for goal in points:
            start = self.position
            length = sum((b - a) ** 2 for a, b in zip(start, goal, strict=True)) ** 0.5
            steps = max(1, round(length / self.speed_m_s * 1e6 / self.step_us))
            velocity = tuple((b - a) / steps / self.step_us * 1e6 for a, b in zip(start, goal, strict=True))
            for i in range(1, steps + 1):
                self.position = tuple(a + (b - a) * i / steps for a, b in zip(start, goal, strict=True))
                self.time_us += self.step_us
                self.state(velocity, contacts)
        return self

    def land(self):
        """Cut the motors and drop onto what is below."""
        self.motors(False)
        self.position = (*self.position[:2], HOME[2] if abs(self.position[0]) < 0.25 else 0.0225)
        return self.wait(1.0)

    def report(self, *args, **kwargs):
        return self.referee.report(*args, **kwargs)


def test_a_clean_try():
    flight = Flight().motors(True).fly(*LAP).land()
    report = flight.report("landing.stop")
    assert report.verdict == "clean"
    assert report.reason == "clean after 10.9 s in landing.stop; crossed: red, green, blue"
    assert report.frames_crossed == ("red", "green", "blue")
    assert report.crossing_times_s == pytest.approx((1.46, 2.46, 3.46), abs=0.02)
    assert report.crossing_offsets_m == pytest.approx((0, 0, 0), abs=1e-9)
    assert report.crossing_sides == ("back", "front", "back")
    assert (report.contacts, report.outside_s, report.penalty_s) == (0, 0.0, 0.0)
    assert report.try_time_s == report.total_time_s == pytest.approx(10.9, abs=0.1)
    assert report.path_length_m == pytest.approx(0.4675 + 4 + 1 + 4 + 1.4)
    assert report.landed_on_base
    assert report.landing_error_m == 0.0
    assert flight.referee.settled
    assert flight.referee.over


def test_the_flown_path_has_ten_positions_a_second_and_is_that_of_the_last_try():
    flight = Flight().motors(True).fly((-3.0, -3.0, 1.0)).motors(False)
    referee = flight.wait(1.0).referee
    times_s = [time_s for time_s, *_ in referee.flown_path]
    steps_s = [after - before for before, after in pairwise(times_s)]
    assert times_s[0] == 0.0
    assert steps_s == pytest.approx([0.1] * len(steps_s), abs=0.02)
    assert max(z for *_, z in referee.flown_path) == pytest.approx(1.0, abs=0.1)


def test_a_report_is_plain_json():
    data = json.loads(json.dumps(Flight().motors(True).fly(*LAP).land().report().as_json()))
    assert data["verdict"] == "clean"
    assert data["frames_crossed"] == ["red", "green", "blue"]
    assert json.loads(json.dumps(Flight().report().as_json()))["landing_error_m"] is None


def test_contacts_make_it_completed_and_a_gap_makes_a_new_one():
    flight = Flight().motors(True).fly(UP)
    flight.wait(0.1, contacts=["red"]).wait(0.3).wait(0.1, contacts=["red", "floor"])  # one
    flight.wait(0.6).wait(0.1, contacts=["red", "blue"])  # two more
    report = flight.fly(*LAP[1:]).land().report()
    assert report.verdict is Verdict.COMPLETED
    assert report.contacts == 3
    assert report.contact_frames == ("red", "red", "blue")


def test_base_and_floor_are_no_gate_contacts():
    report = Flight().motors(True).wait(1, contacts=["base"]).fly(*LAP).land().report()
    assert report.verdict is Verdict.CLEAN


def test_time_outside_is_a_penalty():
    flight = Flight(step_us=30_000).motors(True)
    report = flight.fly(UP, OUT, (7, 0, 1), (7, 0, 5), (0, 0, 5), (0, 0, 0.6)).land().report()
    assert report.verdict is Verdict.COMPLETED
    legs_s = 3.0 * 2 / 3, 3.99, 6.99, 4.41 / 4.4  # in whole steps; the border is met within one
    assert report.outside_s == pytest.approx(sum(legs_s), abs=1e-6)
    assert report.penalty_s == report.outside_s
    assert report.total_time_s == report.try_time_s + report.penalty_s


def test_past_the_limit_nothing_counts():
    flight = Flight().motors(True).fly(UP).wait(60)
    assert flight.referee.over
    flight.fly(*LAP[1:]).land()
    report = flight.report("red.turning")
    assert report.reason == "timed out after 60.0 s in red.turning; crossed: none"
    assert report.verdict is Verdict.TIMED_OUT
    assert report.try_time_s == 60.0
    assert report.landing_error_m is None


def test_motors_off_exactly_at_the_limit_is_within_it():
    flight = Flight().motors(True).fly(*LAP)
    flight.wait((60_000_000 - (flight.time_us - 20_000)) / 1e6 - 0.02)
    assert flight.land().report().try_time_s == 60.0
    assert flight.report().verdict is Verdict.CLEAN


def test_only_motors_off_must_be_within_the_limit():
    flight = Flight().motors(True).fly(*LAP)
    flight.wait((60_000_000 - flight.time_us) / 1e6 - 0.1)
    assert flight.land().report().verdict is Verdict.CLEAN


def test_wrong_order_stays():
    over = (1.5, 0.0, 2.0)
    report = Flight().motors(True).fly(UP, (0, 0, 2), over, (1.5, 0, 1), (2.5, 0, 1), (0, 0, 1), OUT)
    report = report.fly(*LAP[2:]).land().report("x")
    assert report.verdict is Verdict.WRONG_ORDER
    assert report.frames_crossed == ("green", "red", "blue")
    assert "crossed green before red at" in report.reason


def test_a_gate_crossed_again_is_harmless():
    report = (
        Flight()
        .motors(True)
        .fly(UP, (1.5, 0, 1), (0.5, 0, 1), (2.5, 0, 1), (0.5, 0, 1), *LAP[1:])
        .land()
        .report()
    )
    assert report.verdict is Verdict.CLEAN
    assert report.crossing_times_s[0] == pytest.approx(1.46, abs=0.02)


def test_only_the_scenarios_gates_are_required():
    scenario = Scenario(name="one", frames=(Gate(colour="blue", x_m=3, y_m=0, z_m=1),))
    assert Flight(scenario).motors(True).fly(*LAP).land().report().verdict is Verdict.CLEAN
    assert Flight(EMPTY).motors(True).fly(UP, HOME).land().report().verdict is Verdict.CLEAN


def test_a_crash_ends_the_try():
    flight = Flight(speed_m_s=3.0).motors(True).fly((0, 0, 2), (2, 0, 2), (2, 0, 0.02))
    assert flight.referee.over
    report = flight.fly((4, 0, 0.02)).report("red.crossing")
    assert report.verdict is Verdict.CRASHED
    assert "in red.crossing (the drone hit the floor at 3.0 m/s)" in report.reason
    assert report.path_length_m == pytest.approx(1.4675 + 2 + 1.98)
    assert report.landing_error_m is None


def test_lying_on_its_back_in_the_end_is_a_crash():
    flight = Flight().motors(True).fly(*LAP).motors(False)
    flight.position = HOME
    report = flight.wait(1, attitude=(0.5, 0.5, 0.5, 0.5)).report()
    assert report.verdict is Verdict.CRASHED
    assert "came to rest tipped over" in report.reason


def test_falling_when_the_watch_ends_is_a_crash():
    flight = Flight().motors(True).fly((0, 0, 3)).motors(False)
    flight.position = (0, 0, 40)
    assert flight.wait(2, velocity=(0, 0, -20)).report().verdict is Verdict.CRASHED


def test_landing_beside_the_base_is_aborted():
    report = Flight().motors(True).fly(*LAP[:4], (0, 1.5, 2), (0, 1.5, 0.1))
    report.motors(False).position = (0, 1.5, 0.0225)
    report = report.wait(1).report()
    assert report.verdict is Verdict.ABORTED
    assert not report.landed_on_base
    assert report.landing_error_m == 1.5


def test_landing_without_all_gates_is_aborted():
    report = Flight().motors(True).fly(UP, (1.5, 0, 1), UP, HOME).land().report("green.turning")
    assert report.verdict is Verdict.ABORTED
    assert "in green.turning (landed on the base without crossing green, blue); crossed: red" in report.reason
    assert report.landed_on_base


def test_before_and_during_a_try_the_report_is_aborted():
    assert Flight().report().verdict is Verdict.ABORTED
    report = Flight().motors(True).fly(UP).report("red.turning", ended="link lost")
    assert report.reason == "aborted after 0.5 s in red.turning (link lost); crossed: none"


def test_settled_needs_rest_or_two_seconds():
    flight = Flight().motors(True).fly(*LAP).motors(False)
    flight.position = HOME
    assert not flight.wait(0.2).referee.settled
    assert flight.wait(0.2).referee.settled
    restless = Flight().motors(True).fly(*LAP).motors(False)
    restless.position = HOME
    assert not restless.wait(1.9, velocity=(0.1, 0, 0)).referee.settled
    assert restless.wait(0.2, velocity=(0.1, 0, 0)).report().verdict is Verdict.CLEAN


def test_motors_on_again_before_rest_goes_on_with_the_try():
    flight = Flight().motors(True).fly(*LAP).motors(False).wait(0.1).motors(True).fly(UP, HOME)
    assert not flight.referee.over
    report = flight.land().report()
    assert report.verdict is Verdict.CLEAN
    assert report.try_time_s > 11.5


def test_motors_off_without_a_take_off_lets_a_new_try_begin():
    flight = Flight().motors(True).wait(5).motors(False).wait(1)
    assert flight.referee.settled
    assert not flight.referee.over
    assert "never took off" in flight.report().reason
    report = flight.motors(True).fly(*LAP).land().report()
    assert report.verdict is Verdict.CLEAN
    assert report.try_time_s == pytest.approx(10.9, abs=0.1)


def test_nothing_counts_with_motors_off():
    flight = Flight().fly(*LAP[:2], (9, 0, 1), contacts=["red"])
    report = flight.report()
    assert (report.contacts, report.outside_s, report.path_length_m, report.frames_crossed) == (0, 0, 0, ())
    assert report.try_time_s == 0.0


def test_bad_states_are_ignored_and_counted():
    flight = Flight().motors(True)
    for bad in (nan, float("inf")):
        for state in (
            TrueState(flight.time_us + 1, (bad, 0, 1), (0, 0, 0), LEVEL, True),
            TrueState(flight.time_us + 1, (0, 0, 1), (0, bad, 0), LEVEL, True),
            TrueState(flight.time_us + 1, (0, 0, 1), (0, 0, 0), (1, 0, 0, bad), False),
            TrueState(flight.time_us - 1, (0, 0, 1), (0, 0, 0), LEVEL, False),
        ):
            flight.referee.update(state)
    report = flight.fly(*LAP).land().report()
    assert report.verdict is Verdict.CLEAN
    assert report.ignored_states == 8


def test_a_gap_in_the_states_gives_no_crossing():
    flight = Flight().motors(True).fly(UP)
    flight.time_us += 5_000_000
    flight.position = OUT
    report = flight.state().report()
    assert report.frames_crossed == ()
    assert report.longest_gap_s == 5.0
    assert report.path_length_m == pytest.approx(4.4675)


def test_states_at_the_same_time_and_place_change_nothing():
    flight = Flight().motors(True).fly(UP, OUT)
    before = flight.report()
    for _ in range(5):
        flight.state()
    assert flight.report() == before


def test_snapshot_follows_the_try():
    flight = Flight()
    assert flight.referee.snapshot().next_colour == "red"
    snapshot = flight.motors(True).fly(UP, (1.5, 0, 1), (1.5, 6, 1)).referee.snapshot()
    assert (snapshot.crossed, snapshot.next_colour) == (("red",), "green")
    assert (snapshot.inside, snapshot.motors_on, snapshot.over) == (False, True, False)
    assert snapshot.penalty_s == pytest.approx(1.0, abs=0.03)
    assert flight.fly(*LAP[1:]).land().referee.snapshot().over


@settings(max_examples=30)
@given(st.integers(1, 25))
def test_the_rate_of_states_hardly_matters(parts):
    """From 50 Hz to 2 Hz: same crossings, path and time; telemetry of a real drone is judged alike."""
    slow = Flight(step_us=20_000 * parts).motors(True).fly(*LAP).land().report()
    assert slow.verdict is Verdict.CLEAN
    assert slow.crossing_offsets_m == pytest.approx((0, 0, 0), abs=1e-9)
    assert slow.path_length_m == pytest.approx(10.8675)
    assert slow.try_time_s == pytest.approx(10.9, abs=6 * 0.02 * parts)


@given(
    st.lists(
        st.tuples(
            st.integers(-10, 3_000_000),
            st.tuples(*[st.floats(-9, 9)] * 3),
            st.tuples(*[st.floats(-9, 9)] * 3),
            st.sampled_from([LEVEL, (0.0, 1.0, 0.0, 0.0), (nan, 0.0, 0.0, 0.0)]),
            st.booleans(),
            st.sets(st.sampled_from(["red", "floor", "base", "ghost"])).map(tuple),
        ),
        max_size=40,
    )
)
def test_the_report_on_any_states_is_consistent(rows):
    referee = Referee(COURSE, ENVELOPE)
    time_us = 0
    for step_us, position, velocity, attitude, motors_on, contacts in rows:
        time_us += step_us
        referee.update(TrueState(time_us, position, velocity, attitude, motors_on, contacts))
    report = referee.report("some.state")
    assert 0 <= report.outside_s <= report.try_time_s + 3.0 + 1e-9  # one step may pass the limit
    assert 0 <= report.try_time_s <= COURSE.try_limit_s
    assert len(report.contact_frames) == report.contacts
    assert len(report.frames_crossed) == len(set(report.frames_crossed)) == len(report.crossing_times_s)
    assert list(report.crossing_times_s) == sorted(report.crossing_times_s)
    assert "some.state" in report.reason
    assert len(report.reason.splitlines()) == 1
    if report.verdict in {"clean", "completed"}:
        assert report.landed_on_base
        assert report.frames_crossed == ("red", "green", "blue")


GOALS = Scenario.model_validate(
    {
        "name": "goals",
        "frames": [{"colour": "red", "x_m": 3.0, "y_m": 0.0, "z_m": 1.0}],
        "goals": [{"hold_m": (0.0, 0.0, 1.0), "seconds": 1.0}, {"face": "red", "distance_m": (1.0, 2.5)}],
    }
)
FACING = LEVEL
AWAY = (0.0, 0.0, 0.0, 1.0)


def test_goals_are_reached_in_order_and_instead_of_crossing():
    flight = Flight(GOALS).motors(True).fly(UP).wait(0.5)
    assert "without being" not in flight.referee.report().reason
    flight.wait(0.6).fly((1.0, 0.0, 1.0)).wait(1.1, attitude=FACING).fly(UP, HOME).motors(False).wait(1.0)
    report = flight.referee.report()
    assert report.verdict is Verdict.CLEAN
    assert report.frames_crossed == ()
    first, second = report.goal_times_s
    assert 1.0 < first < 2.2
    assert second > first + 1.0


def test_a_goal_that_is_interrupted_begins_again():
    flight = Flight(GOALS).motors(True).fly(UP).wait(0.4).fly((0.6, 0.0, 1.0), UP).wait(0.4)
    assert flight.referee.report().goal_times_s == ()
    flight.wait(0.6)
    assert len(flight.referee.report().goal_times_s) == 1


def test_looking_elsewhere_or_from_too_far_is_not_facing():
    flight = Flight(GOALS).motors(True).fly(UP).wait(1.1).wait(2.0)  # faces it from 3 m
    assert len(flight.referee.report().goal_times_s) == 1
    flight.fly((1.0, 0.0, 1.0)).wait(0.3, attitude=FACING).wait(2.0, attitude=AWAY)
    assert len(flight.referee.report().goal_times_s) == 1
    flight.fly(UP, HOME).motors(False).wait(1.0)
    report = flight.referee.report()
    assert report.verdict is Verdict.ABORTED
    assert "landed on the base without being facing red from 1 to 2.5 m away for 1 s" in report.reason
