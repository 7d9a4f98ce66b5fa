"""The source of the verdict, and that a judge which fails does not end a flight."""

from contextlib import asynccontextmanager

import aiohttp
import pytest
from aiohttp import web

from framerunner.errors import SettingError
from framerunner.flying.judges import TelemetryJudge, TruthJudge, ask_referee, choose_judge
from framerunner.flying.plan import FlightPlan
from framerunner.wire.simulator_api import SimulatorApi
from offboard.app import Moment
from offboard.drone import DroneState, VelocityFluCommand
from scenarios.loader import load_scenario
from scenarios.result import RefereeReport
from vision.types import Detections

SCENARIO = load_scenario("test-case-1")
PLAN = FlightPlan(SCENARIO)
NO_SIMULATOR = SimulatorApi("http://127.0.0.1:9")
SNAPSHOT = {
    "began_us": 3,
    "try_time_s": 7.5,
    "penalty_s": 0.0,
    "crossed": ["red"],
    "next_colour": "green",
    "contacts": 1,
    "inside": True,
    "motors_on": False,
    "settled": False,
    "over": False,
}


@asynccontextmanager
async def referee(*answers):
    """A server that repeats its last answer: its root URL, a session, the queries received."""
    queue, queries = list(answers), []

    async def answer(request):
        queries.append(dict(request.query))
        body = queue.pop(0) if len(queue) > 1 else queue[0]
        return web.Response(text=body) if isinstance(body, str) else web.json_response(body)

    app = web.Application()
    app.router.add_get("/referee.json", answer)
    runner = web.AppRunner(app)
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0)
    await site.start()
    port = runner.addresses[0][1]
    try:
        async with aiohttp.ClientSession() as session:
            yield f"http://127.0.0.1:{port}", session, queries
    finally:
        await runner.cleanup()


def answer(scenario=SCENARIO.name, time_us=0, **snapshot):
    return {
        "scenario": scenario,
        "time_us": time_us,
        "snapshot": {**SNAPSHOT, **snapshot},
        "report": {"verdict": "clean"},
    }


async def test_the_simulator_of_the_camera_is_the_judge():
    async with referee(answer(began_us=None), answer()) as (root, session, _):
        judge, _ = await choose_judge(PLAN, SimulatorApi.of_video(f"{root}/video"), session)
        assert judge.source == "truth"
        standing = await judge.standing()
        assert (standing.try_time_s, standing.crossed, standing.contacts) == (7.5, ("red",), 1)


async def test_a_referee_by_telemetry_is_not_taken_for_the_truth():
    async with referee({**answer(), "source": "telemetry"}) as (root, session, _):
        judge, _ = await choose_judge(PLAN, SimulatorApi(root), session)
        assert isinstance(judge, TruthJudge)
        assert judge.source == "telemetry"


@pytest.mark.parametrize("over", [True, False])
async def test_the_verdict_of_an_earlier_flight_is_not_that_of_this_one(over):
    """A flight that is stopped before arming begins no try."""
    earlier, now = answer(over=over, settled=True, began_us=3), answer(over=True, began_us=7)
    async with referee(earlier, earlier, earlier, earlier, now) as (root, session, _):
        judge, _ = await choose_judge(PLAN, SimulatorApi(root), session)
        assert await judge.standing() is None
        report = await judge.report("searching", "stopped by the operator")
        assert (report.verdict, judge.source) == ("aborted", "telemetry")
        assert (await judge.standing()).began_us == 7


@pytest.mark.parametrize(
    "body", [answer("another-place"), "not json", {"weather": "fine"}, answer(contacts="many")], ids=str
)
async def test_what_is_not_the_referee_of_this_scenario_does_not_judge(body):
    async with referee(body) as (root, session, _):
        judge, plan = await choose_judge(PLAN, SimulatorApi(root), session)
        assert (judge.source, plan) == ("telemetry", PLAN)


def standing_at(x, y, yaw):
    return {"position_arena_m": [x, y, 0.5], "yaw_rad": yaw}


async def test_a_drone_that_has_flown_before_starts_from_where_it_stands():
    before = answer(over=True, began_us=3)
    async with referee({**before, "stands_at": standing_at(-2.9, -3.1, 1.5)}) as (root, session, _):
        _, plan = await choose_judge(PLAN, SimulatorApi(root), session)
    assert plan.start_pose == (-2.9, -3.1, PLAN.start_pose[2], 1.5)
    assert plan.layout.frames == PLAN.layout.frames
    async with referee({**before, "source": "telemetry"}, answer()) as (root, session, _):
        for _ in range(2):  # a virtual camera; then a first flight
            assert (await choose_judge(PLAN, SimulatorApi(root), session))[1].start_pose == PLAN.start_pose


@pytest.mark.parametrize("place", [None, standing_at(90.0, 0.0, 0.0)], ids=["on its side", "outside"])
async def test_a_drone_that_cannot_start_from_where_it_is_is_told(place, capsys):
    async with referee({**answer(over=True, began_us=3), "stands_at": place}) as (root, session, _):
        _, plan = await choose_judge(PLAN, SimulatorApi(root), session)
    assert plan.start_pose == PLAN.start_pose
    assert "has flown before" in capsys.readouterr().err


async def test_a_camera_that_shows_another_scenario_is_told(capsys):
    async with referee(answer("another-place")) as (root, session, _):
        await choose_judge(PLAN, SimulatorApi(root), session)
    assert f"warning: {root} shows the scenario another-place" in capsys.readouterr().err


@pytest.mark.parametrize("url", ["http://127.0.0.1:9/video", "rtsp://127.0.0.1/live", "0", "/tmp/images"])
async def test_another_camera_leaves_the_verdict_to_telemetry(url):
    async with aiohttp.ClientSession() as session:
        judge, _ = await choose_judge(PLAN, SimulatorApi.of_video(url), session)
        assert judge.source == "telemetry"


async def test_gates_are_where_the_referee_has_them():
    async with referee({**answer(), "source": "telemetry", "lift_m": 0.25}) as (root, session, _):
        _, plan = await choose_judge(PLAN, SimulatorApi(root), session)
    assert plan == PLAN.lifted(0.25)


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ("not json", "nothing there answers"),
        (answer("another-place"), "scenario another-place; start it"),
    ],
    ids=str,
)
async def test_a_simulator_that_was_named_must_judge(body, words):
    async with referee(body) as (root, session, _):
        with pytest.raises(SettingError, match=words) as refused:
            await choose_judge(PLAN, SimulatorApi(root), session, named=True)
    assert f"--simulator {root}" in str(refused.value)


async def test_the_report_is_requested_when_the_drone_is_at_rest():
    async with referee(answer(), answer(), answer(settled=True)) as (root, session, queries):
        judge = TruthJudge(SimulatorApi(root), session, PLAN)
        assert await judge.report("landing.stop", None) == RefereeReport(verdict="clean")
    assert queries == [{}, {}, {}, {"state": "landing.stop"}]


async def test_a_drone_that_flies_on_is_not_waited_for():
    async with referee(answer(motors_on=True)) as (root, session, queries):
        await TruthJudge(SimulatorApi(root), session, PLAN).report("red.turning", "link lost & gone")
    assert queries == [{}, {"state": "red.turning", "ended": "link lost & gone"}]


async def test_the_referee_may_see_the_disarming_later_than_the_app():
    """Heartbeats are sent once a second, on each link at another time; then the referee waits for rest."""
    late = [answer(time_us=250_000 * step, motors_on=True) for step in range(8)]
    async with referee(*late, answer(time_us=2_100_000, settled=True)) as (root, session, queries):
        judge = TruthJudge(SimulatorApi(root), session, PLAN)
        assert await judge.report("landing.touch_down", None) == RefereeReport(verdict="clean")
    assert queries == [{}] * 9 + [{"state": "landing.touch_down"}]


async def test_the_wait_for_a_missing_disarming_is_in_vehicle_time(monkeypatch):
    monkeypatch.setattr("framerunner.flying.judges._POLL_S", 0.0)
    never = [answer(time_us=500_000 * step, motors_on=True) for step in range(20)]
    async with referee(*never) as (root, session, queries):
        await TruthJudge(SimulatorApi(root), session, PLAN).report("landing.touch_down", None)
    assert len(queries) == 12 + 1  # 0 to 5.5 s, then the report


async def test_a_referee_whose_clock_stands_still_is_not_waited_for(monkeypatch):
    monkeypatch.setattr("framerunner.flying.judges._CLOCK_STOPPED_S", 0.2)
    async with referee(answer(time_us=7, motors_on=True)) as (root, session, queries):
        await TruthJudge(SimulatorApi(root), session, PLAN).report("landing.touch_down", None)
    assert 2 <= len(queries) <= 5


async def test_a_referee_that_has_ended_has_no_standing():
    async with aiohttp.ClientSession() as session:
        assert await ask_referee(NO_SIMULATOR, session) is None
        assert await TruthJudge(NO_SIMULATOR, session, PLAN).standing() is None


def moment(time_s, x, z, *, armed=True):
    state = DroneState(round(time_s * 1e6), x, -3.0, z, 1.0, (0.0, 0.0, 0.0), armed)
    return Moment(state, VelocityFluCommand(), Detections(), "take_off.rise", time_s)


async def test_telemetry_is_judged_tick_by_tick():
    judge = TelemetryJudge(PLAN.new_referee())
    judge.see(moment(10.0, -3.0, 0.55, armed=False))
    for tick in range(100):
        judge.see(moment(10.05 + 0.05 * tick, -3.0, min(0.55 + 0.05 * tick, 2.0)))
    standing = await judge.standing()
    assert standing.try_time_s == pytest.approx(4.95, abs=0.06)
    assert standing.motors_on
    report = await judge.report("take_off.rise", "pilot took over")
    assert report.verdict == "aborted"
    assert "pilot took over" in report.reason
    assert report.path_length_m == pytest.approx(1.45, abs=0.1)


@pytest.mark.parametrize(("x_m", "z_m"), [(-2.93, 0.3), (-2.93, 0.55), (-2.6, 0.55)])
async def test_without_a_base_it_lands_where_the_base_would_be_or_beside_it(x_m, z_m):
    """A floor may be soft, or the estimate low: only x and y count."""
    judge = TelemetryJudge(PLAN.lifted(SCENARIO.base.top_m).new_referee())
    for tick in range(20):
        judge.see(moment(10.0 + 0.05 * tick, -3.0, 0.55 + 0.05 * tick))
    for tick in range(40):
        judge.see(moment(20.0 + 0.05 * tick, x_m, z_m, armed=False))
    report = await judge.report("landing.touch_down", None)
    assert report.landed_on_base == (x_m == -2.93)
    assert report.landing_error_m == pytest.approx(x_m + 3.0)


async def test_telemetry_judges_when_the_simulator_has_ended():
    async with aiohttp.ClientSession() as session:
        judge = TruthJudge(NO_SIMULATOR, session, PLAN)
        assert judge.source == "truth"
        for tick in range(40):
            judge.see(moment(10.0 + 0.05 * tick, -3.0, 0.6 + 0.05 * tick, armed=tick > 0))
        report = await judge.report("red.turning", "link lost")
    assert judge.source == "telemetry"
    assert report.verdict == "aborted"
    assert "link lost" in report.reason
