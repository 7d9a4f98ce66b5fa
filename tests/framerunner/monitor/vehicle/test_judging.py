"""Tries of real flights, judged by the drone's referee, by the monitor's own, and by the app."""

import pytest

from firmware_py.status import FlightMode
from framerunner.flying.plan import FlightPlan
from framerunner.monitor.vehicle.track import Source
from framerunner.wire.dialect import mavlink
from framerunner.wire.mission_tunnel import (
    DOCUMENT_TYPE,
    STATE_TYPE,
    DocumentKind,
    MissionState,
    encode_state,
    split_document,
)
from scenarios.loader import load_scenario
from scenarios.models import TrueState
from tests.framerunner.monitor.simulated_link import SimulatedLink, equipment, served_link
from tests.framerunner.monitor.vehicle.test_mission_view import tunnel
from tests.framerunner.monitor.watching import watching

SCENARIO = load_scenario("test-case-1")


class Hop:
    """Flies a drone by its own autopilot: up after two seconds, down again some seconds later."""

    def __init__(self, drone, air_s=4.0):
        self.air_us = round(air_s * 1e6)
        drone.each_tick = self

    def __call__(self, simulation):
        now_us, autopilot = simulation.time_us, simulation.autopilot
        if now_us == 8_000_000:
            autopilot.takeoff()
            autopilot.arm()
        if now_us == 8_000_000 + self.air_us:
            autopilot.set_mode(FlightMode.LAND)


def ended(watched):
    return [event for event in watched.tries if event.kind == "ended"]


async def test_the_drone_s_referee_is_used_until_the_end():
    async with served_link(SCENARIO, speed=8.0) as link, watching(equipment(link)) as watched:
        Hop(link.drones[0])
        await watched.until(lambda: ended(watched), 30.0)
        truth = link.drones[0].simulation.referee
        event = ended(watched)[0]
        assert event.report.as_json() == link.drones[0].referee_answer()["report"]
        assert (event.scenario, event.source, event.final) == (SCENARIO.name, "truth", False)
        assert event.key == f"1-170000000-{truth.snapshot().began_us}"
        figures = watched.status()["figures"]
        assert figures["try_time_s"] == truth.try_time_s
        assert (figures["verdict"], figures["over"], figures["final"]) == (
            event.report.verdict,
            True,
            False,
        )
        await result_follows(watched, link)


async def result_follows(watched, link):
    """The app sends the content of its result.json through the drone's links."""
    content = {
        **link.drones[0].referee_answer()["report"],
        "scenario": SCENARIO.name,
        "judged_by": "truth",
        "ended": "finished",
        "verdict": "clean",
        "reason": "as the app says",
    }
    _, pieces = split_document(DocumentKind.RESULT, content)
    for piece in pieces:
        link.say_as_app(tunnel(DOCUMENT_TYPE, piece))
    await watched.until(lambda: ended(watched)[-1].final)
    figures = watched.status()["figures"]
    assert (figures["final"], figures["reason"]) == (True, "as the app says")
    assert figures["total_time_s"] == content["total_time_s"]
    assert len(ended(watched)) == 2
    assert len({event.key for event in watched.tries}) == 1


async def test_the_monitors_own_referee_judges_as_one_that_is_fed_directly(monkeypatch):
    link = SimulatedLink(SCENARIO, speed=6.0)
    Hop(link.drones[0], air_s=8.0)
    fed = FlightPlan(SCENARIO).new_referee()
    async with watching(equipment(link, SCENARIO)) as watched:
        vehicle = await watched.until(lambda: watched.fleet._vehicles.get(1))
        await watched.until(lambda: vehicle._placement.source is Source.START)
        follow = vehicle._judging.follow

        def follow_and_feed(telemetry, placement):
            follow(telemetry, placement)
            pose = vehicle.pose(0.0)
            position, alignment = telemetry.position, placement.alignment
            fed.update(
                TrueState(
                    position.time_us,
                    alignment.position(position.position_ned_m),
                    alignment.vector(position.velocity_ned_m_s),
                    tuple(pose["q"]),
                    telemetry.armed,
                )
            )

        monkeypatch.setattr(vehicle._judging, "follow", follow_and_feed)
        await watched.until(lambda: ended(watched), 30.0)
        event = ended(watched)[0]
        truth = link.drones[0].simulation.referee.report()
    told, expected = event.report.as_json(), fed.report().as_json()
    assert told.pop("ignored_states") == expected.pop("ignored_states") == 0
    assert told == expected
    assert event.source == "telemetry"
    assert watched.tries[0].kind == "began"
    assert told["landed_on_base"] is truth.landed_on_base
    assert told["landing_error_m"] == pytest.approx(truth.landing_error_m, abs=0.01)
    assert told["try_time_s"] == pytest.approx(truth.try_time_s, abs=2.1)  # heartbeats come once a second
    assert told["path_length_m"] == pytest.approx(truth.path_length_m, rel=0.05)


async def test_time_is_over_at_the_scenarios_limit():
    short = SCENARIO.model_copy(update={"try_limit_s": 5.0})
    async with served_link(short, speed=8.0) as link, watching(equipment(link)) as watched:
        Hop(link.drones[0], air_s=30.0)
        await watched.until(lambda: ended(watched), 30.0)
        figures = watched.status()["figures"]
        assert (figures["time_over"], figures["limit_s"], figures["try_time_s"]) == (True, 5.0, 5.0)
        assert figures["verdict"] == "timed out"


async def test_the_app_s_pose_places_the_drone_without_another_source():
    link = SimulatedLink(SCENARIO)
    async with watching(equipment(link)) as watched:
        await watched.until_ready(link)

        def tell():
            with link.lock:
                truth = link.drones[0].simulation.truth
                pose = (*truth.position_arena_m, SCENARIO.start.yaw_rad)
                state = MissionState(0, 0, 0, truth.time_us, 0, True, False, False, (0.0,) * 4, pose)
                link.say_as_app(tunnel(STATE_TYPE, encode_state(state)))

        tell()
        start = (SCENARIO.start.x_m, SCENARIO.start.y_m)
        await watched.until(lambda: watched.pose()["p"][:2] == pytest.approx(start, abs=0.01))
        assert watched.pose()["c"] == [0.0] * 4
        assert watched.pose()["s"] == 0
        await watched.until(lambda: watched.status()["mission"]["alive"] is False)
        assert (watched.pose()["c"], watched.pose()["s"]) == (None, -1)


async def test_texts_of_drone_and_mission_are_text():
    link = SimulatedLink(SCENARIO)
    async with watching(equipment(link)) as watched:
        await watched.until_ready(link)
        with link.lock:
            link.drones[0].simulation.autopilot.say(4, "<b>mind</b> the gap " * 4)
        link.say_as_app(mavlink.MAVLink_statustext_message(6, b"mission: <i>red.turning</i>", 0, 0))
        texts = await watched.until(
            lambda: (
                [m for m in watched.of_kind("text") if "<" in m["text"]][1:]
                and [m for m in watched.of_kind("text") if "<" in m["text"]]
            )
        )
    assert {(m["from"], m["severity"], m["text"]) for m in texts} == {
        ("drone", 4, ("<b>mind</b> the gap " * 4).strip()),
        ("mission", 6, "mission: <i>red.turning</i>"),
    }
    assert [m for m in watched.fleet._texts if "<" in m["text"]] == texts
