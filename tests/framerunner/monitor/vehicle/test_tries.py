"""Tries: when they begin and end, and which result belongs to which."""

from dataclasses import replace

import pytest

from framerunner.monitor.vehicle.tries import TryWatch, figures
from scenarios.result import (
    BegunFault,
    FailsafeText,
    FaultFacts,
    FlightResult,
    RefereeReport,
    RefereeSnapshot,
    Standing,
)

FLYING = RefereeSnapshot(5_000_000, 10.0, 0.0, ("red",), "green", 0, True, True, False, False)
REPORT = RefereeReport(verdict="aborted", reason="still flying", try_time_s=10.0, crossing_times_s=(4.0,))
CLEAN = RefereeReport(**{**dict(REPORT), "verdict": "clean", "reason": "all crossed"})


def standing(snapshot=FLYING, report=REPORT, *, source="truth", **changes):
    return Standing(scenario="s", source=source, snapshot=replace(snapshot, **changes), report=report)


def landed(time_s=40.0, **changes):
    return standing(report=CLEAN, try_time_s=time_s, motors_on=False, settled=True, over=True, **changes)


def result(time_s=40.0, **changes):
    told = {"scenario": "s", "judged_by": "truth", "ended": "finished", "verdict": "clean"}
    return FlightResult.from_outside({**told, "try_time_s": time_s, **changes})


@pytest.fixture
def events():
    return []


@pytest.fixture
def watch(events):
    return TryWatch(1, "boot", events.append, 0.0)


def kinds(events):
    return [(event.kind, event.final) for event in events]


def test_a_try_begins_runs_every_second_and_ends(watch, events):
    watch.see(standing(began_us=None), 1.0)
    assert events == []
    for tick in range(16):
        watch.see(standing(), 1.0 + tick * 0.2)
    watch.see(landed(), 4.2)
    watch.see(landed(), 4.4)
    assert kinds(events) == [("began", False), *[("running", False)] * 3, ("ended", False)]
    assert {event.key for event in events} == {"1-boot-5000000"}
    last = events[-1]
    assert (last.scenario, last.source, last.report) == ("s", "truth", CLEAN)


def test_a_try_without_a_take_off_ends(watch, events):
    watch.see(standing(), 1.0)
    watch.see(standing(motors_on=False, settled=True), 2.0)
    assert kinds(events)[-1] == ("ended", False)


def test_the_apps_result_makes_it_final_once(watch, events):
    watch.see(landed(), 1.0)
    watch.take_result(7, result(), 1.2)
    watch.take_result(7, result(), 1.4)
    watch.see(landed(), 1.6)
    watch.tick(9.0)
    assert kinds(events) == [("began", False), ("ended", False), ("ended", True)]
    assert events[-1].key == events[0].key
    assert events[-1].report == result() == watch.result


def test_a_result_before_the_referee_s_end_waits(watch, events):
    watch.see(standing(try_time_s=39.9), 1.0)
    watch.take_result(7, result(), 1.1)
    assert kinds(events) == [("began", False)]
    watch.see(landed(), 1.3)
    assert kinds(events)[1:] == [("ended", False), ("ended", True)]


def test_the_result_of_an_earlier_try_is_not_counted_again(watch, events):
    watch.see(landed(), 1.0)
    watch.take_result(7, result(), 1.2)
    watch.see(standing(began_us=90_000_000), 5.0)
    assert watch.result is None
    watch.take_result(7, result(), 5.1)
    watch.see(landed(40.0, began_us=90_000_000), 45.0)
    assert kinds(events)[-1] == ("ended", False)
    assert watch.result is None


def test_an_earlier_unclaimed_result_is_not_counted_either(watch, events):
    watch.see(landed(40.0), 1.0)
    watch.take_result(7, result(55.0), 1.2)  # of which try? none that was seen
    watch.see(landed(55.0, began_us=90_000_000), 5.0)
    assert [event.final for event in events] == [False] * 4
    watch.take_result(7, result(55.0), 5.2)
    assert watch.result is None


def test_a_repeated_result_is_not_taken_for_the_try_that_is_flown(watch, events):
    watch.take_result(7, result(40.0), 0.5)
    watch.see(standing(try_time_s=12.0), 1.0)
    watch.see(standing(try_time_s=40.0), 29.0)  # the time fits by chance, but it is still flown
    assert watch.result is None
    watch.see(landed(47.0), 36.0)
    assert kinds(events)[-1] == ("ended", False)


def test_a_result_of_another_scenario_is_not_taken(watch):
    watch.see(landed(), 1.0)
    watch.take_result(7, result(scenario="other"), 1.2)
    assert watch.result is None


def test_an_aborted_app_ends_the_try_in_the_air(watch, events):
    watch.see(standing(try_time_s=20.0), 1.0)
    watch.take_result(7, result(20.1, ended="aborted", verdict="aborted"), 1.1)
    assert kinds(events)[-1] == ("ended", True)
    watch.see(landed(30.0), 11.0)
    assert kinds(events)[-1] == ("ended", True)
    assert len(events) == 2


def test_two_referees_may_differ_by_their_heartbeats(watch):
    watch.see(landed(41.2, began_us=1), 1.0)
    watch.take_result(7, result(40.0, judged_by="telemetry"), 1.2)
    assert watch.result is not None


def test_a_try_ends_when_its_referee_is_gone_and_goes_on_when_it_returns(watch, events):
    watch.see(standing(), 1.0)
    watch.tick(3.9)
    assert kinds(events) == [("began", False)]
    watch.tick(4.1)
    assert kinds(events)[-1] == ("ended", False)
    assert events[-1].report.reason == "still flying; nothing was heard of it for 3 s"
    watch.see(standing(), 6.0)
    assert kinds(events)[-1] == ("running", False)
    watch.see(landed(), 8.0)
    assert kinds(events)[-1] == ("ended", False)
    assert len({event.key for event in events}) == 1


def test_a_result_is_taken_after_the_referee_is_gone(watch):
    watch.see(standing(try_time_s=39.8), 1.0)
    watch.take_result(7, result(40.0), 1.1)
    assert watch.result is None
    watch.tick(4.5)
    assert watch.result == result(40.0)


def test_the_next_try_ends_the_one_before(watch, events):
    watch.see(standing(), 1.0)
    watch.see(standing(began_us=90_000_000), 1.2)
    assert kinds(events) == [("began", False), ("ended", False), ("began", False)]
    assert events[0].key != events[2].key


def test_a_restart_ends_it(watch, events):
    watch.see(standing(), 1.0)
    watch.close()
    assert events[-1].report.reason.endswith("the drone restarted")


def test_without_a_referee_the_app_s_result_counts(watch, events):
    watch.take_result(7, result(), 2.0)
    watch.tick(9.0)
    assert events == []
    watch.tick(11.0)
    assert kinds(events) == [("began", False), ("ended", True)]
    watch.take_result(8, result(33.0), 30.0)
    watch.tick(30.1)
    assert kinds(events)[2:] == [("began", False), ("ended", True)]
    assert len({event.key for event in events}) == 2


@pytest.mark.parametrize("time_s", [0.0, None, "40", True, float("nan")])
def test_a_result_without_a_try_time_is_ignored(watch, events, time_s):
    watch.take_result(7, result(time_s), 2.0)
    watch.tick(20.0)
    assert events == []


def test_figures_of_a_try_that_is_flown():
    told = figures(standing(penalty_s=1.5), None, 180.0)
    assert told == {
        "try_time_s": 10.0,
        "penalty_s": 1.5,
        "total_time_s": 11.5,
        "crossed": ["red"],
        "crossing_times_s": [4.0],
        "next_colour": "green",
        "contacts": 0,
        "inside": True,
        "motors_on": True,
        "over": False,
        "verdict": "",
        "reason": "",
        "source": "truth",
        "final": False,
        "limit_s": 180.0,
        "time_over": False,
    }


def test_figures_tell_what_has_failed():
    facts = FaultFacts(
        begun=(
            BegunFault(fault="gps off at 3 s for 1 s", began_us=8_000_000, ended_us=9_000_000),
            BegunFault(fault="motor 1 off at 5 s", began_us=10_000_000),
        ),
        failsafes=(FailsafeText(time_us=10_600_000, text="Attitude failure: flight terminated"),),
    )
    told = figures(standing().model_copy(update={"faults": facts}), None, 180.0)
    assert told["faults"] == [
        {"fault": "gps off at 3 s for 1 s", "active": False},
        {"fault": "motor 1 off at 5 s", "active": True},
    ]
    assert told["failsafe"] == "Attitude failure: flight terminated"


def test_time_is_over_at_the_limit():
    assert not figures(standing(try_time_s=179.99), None, 180.0)["time_over"]
    assert figures(standing(try_time_s=180.0), None, 180.0)["time_over"]
    assert not figures(standing(try_time_s=9999.0), None, None)["time_over"]


def test_final_figures_are_those_of_the_result():
    app = result(
        41.25,
        penalty_s=0.5,
        total_time_s=41.75,
        frames_crossed=["red", "green"],
        crossing_times_s=[1.5, 2.5],
        contacts=3,
        reason="so it was",
    )
    told = figures(landed(), app, 180.0)
    shown = {
        key: told[key] for key in ("try_time_s", "penalty_s", "total_time_s", "verdict", "reason", "contacts")
    }
    assert shown == {key: getattr(app, key) for key in shown}
    assert (told["crossed"], told["crossing_times_s"]) == (["red", "green"], [1.5, 2.5])
    assert (told["final"], told["over"]) == (True, True)
    assert figures(None, app, None)["total_time_s"] == 41.75


def test_there_are_no_figures_without_a_source():
    assert figures(None, None, 180.0) is None
