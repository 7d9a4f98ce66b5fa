"""What the audience's page gets: split times, the best try to compare with, and when the round is over."""

import pytest

from scenarios.result import RefereeReport
from tests.framerunner.monitor.competition import harness
from tests.framerunner.monitor.competition.harness import COLOURS, contest, event


@pytest.fixture
async def running(tmp_path, monkeypatch):
    monkeypatch.setattr(harness, "MODULES", (*harness.MODULES, "framerunner.monitor.competition.stage"))
    async with contest(f"sqlite:///{tmp_path}/contest.db", monkeypatch) as running:
        await running.log_in()
        yield running


async def stage(running):
    status, told = await running.get("stage")
    assert status == 200
    return told


async def fly(running, key, team, times, scenario="case-1", verdict="clean"):
    """A try that crosses a gate at each of the times and ends ten seconds later."""
    began = event("began", key, scenario, time_s=0.0)
    known = {"verdict": verdict, "crossed": COLOURS[: len(times)], "time_s": times[-1] + 10}
    ended = event("ended", key, scenario, told={"crossing_times_s": times}, **known)
    if team is not None:
        await running.post("next", {"team": team, "scenario": scenario})
    running.fleet.tell(began)
    await running.until("tries", lambda all_: all_ and all_[0]["state"] == "running")
    running.fleet.tell(ended)
    return (await running.until("tries", lambda all_: all_[0]["state"] == "ended"))[0]


async def test_a_try_is_compared_with_the_best_one_without_it(running):
    assert (await stage(running))["last"] is None
    falken, adler = [(await running.post("teams", {"name": name}))[1]["team"] for name in ("Falken", "Adler")]
    await fly(running, "test flight", None, [10.0, 20.0, 30.0])
    await fly(running, "a", falken, [30.0, 60.0, 90.0])
    await fly(running, "b", adler, [25.0, 50.0], verdict="aborted")
    told = await stage(running)
    assert told["last"]["team_name"] == "Adler"
    assert told["last"]["splits"] == {"red": 25.0, "green": 50.0}
    assert not told["last"]["completed"]
    assert told["last_against"]["splits"] == {"red": 30.0, "green": 60.0, "blue": 90.0}
    # Quicker, but not completed; and the quickest was flown by no team.
    assert [each["team_name"] for each in told["best"]] == ["Falken"]

    await fly(running, "c", adler, [20.0, 40.0, 60.0])
    told = await stage(running)
    assert (told["last"]["total_s"], told["last_against"]["team_name"]) == (70.0, "Falken")
    assert [(each["team_name"], each["total_s"]) for each in told["best"]] == [("Adler", 70.0)]


async def test_a_judges_correction_counts(running):
    falken = (await running.post("teams", {"name": "Falken"}))[1]["team"]
    flown = await fly(running, "a", falken, [30.0, 60.0, 90.0])
    form = {"seen": 0, "crossed": ["red", "green"]}
    assert (await running.post(f"tries/{flown['id']}/judgement", form))[0] == 200
    told = (await stage(running))["last"]
    assert told["splits"] == {"red": 30.0, "green": 60.0}
    assert (told["completed"], told["verdict"]) == (False, "corrected by a judge")


async def test_the_round_is_complete_when_every_team_has_flown_every_scenario(running):
    rule = {"limit_s": 180.0, "missing_frame_s": 60.0, "scenarios": 1, "counting": "best"}
    await running.post("settings", rule)
    teams = [(await running.post("teams", {"name": name}))[1]["team"] for name in ("Falken", "Adler")]
    await fly(running, "a", teams[0], [30.0, 60.0, 90.0])
    assert not (await stage(running))["complete"]
    await running.post("next", {"team": teams[1], "scenario": "case-1"})
    assert (await stage(running))["called"]["team_name"] == "Adler"
    await fly(running, "b", teams[1], [30.0], verdict="aborted")
    told = await stage(running)
    assert told["complete"]
    assert [row["name"] for row in told["ranking"]["rows"]] == ["Falken", "Adler"]


@pytest.mark.parametrize(
    "report",
    [
        {},
        {"frames_crossed": "red", "crossing_times_s": [1.0]},
        {"frames_crossed": ["red", 7, "blue"], "crossing_times_s": [None, 2.0, True]},
        {"frames_crossed": ["red", "green"], "crossing_times_s": [-1.0, 1e12]},
    ],
)
def test_invalid_split_times_are_left_out(report):
    assert RefereeReport.from_outside({"verdict": "clean", **report}).times_s == {}


async def test_an_interrupted_try_is_shown_as_last_seen(tmp_path, monkeypatch):
    monkeypatch.setattr(harness, "MODULES", (*harness.MODULES, "framerunner.monitor.competition.stage"))
    database = f"sqlite:///{tmp_path}/contest.db"
    going = event("running", "a", time_s=40.0, crossed=("red",), told={"crossing_times_s": [31.0]})
    async with contest(database, monkeypatch) as before:
        before.fleet.tell(event("began", "a", time_s=0.0))
        before.fleet.tell(going)
        await before.until("tries", lambda all_: all_ and all_[0]["state"] == "running")
        await before.until("tries/1", lambda told: told["try"]["referee"]["try_time_s"] == 40.0)
    async with contest(database, monkeypatch) as after:
        told = await stage(after)
        assert (told["interrupted"]["try_time_s"], told["interrupted"]["splits"]) == (40.0, {"red": 31.0})
        assert told["last"] is None
        after.fleet.tell(going)  # it continues and is judged
        await after.until("tries", lambda all_: all_[0]["state"] == "running")
        assert (await stage(after))["interrupted"] is None
