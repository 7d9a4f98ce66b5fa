"""What the fleet shows of real simulations behind a link without sockets."""

import asyncio
import json
import re
from math import hypot

import pytest
from pydantic import TypeAdapter

from framerunner.monitor.live_channel import encode
from framerunner.monitor.live_messages import LiveMessage
from framerunner.monitor.vehicle.commands import Sticks
from scenarios.loader import load_scenario
from tests.framerunner.monitor.simulated_link import SimulatedLink, all_finite, equipment, served_link
from tests.framerunner.monitor.watching import watching

SCENARIO = load_scenario("test-case-1")


@pytest.fixture
def link():
    return SimulatedLink(SCENARIO)


def nearest(drone, pose):
    return drone.truths[round(pose["t"] * 1000)]


def error_m(drone, pose):
    truth = nearest(drone, pose)
    return hypot(*(told - true for told, true in zip(pose["p"], truth.position_arena_m, strict=True)))


def turn_rad(drone, pose):
    """Angle between the attitude sent and the true one."""
    truth = nearest(drone, pose).attitude_arena
    dot = abs(sum(told * true for told, true in zip(pose["q"], truth, strict=True)))
    return 2 * (1 - min(1.0, dot)) ** 0.5 * 2**0.5


async def fly_a_little(watched, link, seconds=8.0):
    """Take off, turn and move; returns the poses."""
    await watched.until_ready(link)
    with link.lock:
        autopilot = link.drones[0].simulation.autopilot
        autopilot.takeoff()
        autopilot.arm()
        end_us = link.drones[0].simulation.time_us + seconds * 1e6
    poses = []
    while link.drones[0].simulation.time_us < end_us:
        await asyncio.sleep(0.005)
        with link.lock:
            pose = watched.pose()
            if not poses or poses[-1][0]["t"] != pose["t"]:
                poses.append((pose, error_m(link.drones[0], pose), turn_rad(link.drones[0], pose)))
    return poses


async def test_poses_are_true_with_a_given_scenario(link):
    async with watching(equipment(link, SCENARIO)) as watched:
        await watched.until(lambda: watched.pose() and watched.pose()["p"][2] > 0.5)  # its place is known
        poses = await fly_a_little(watched, link)
    assert poses[-1][0]["p"][2] > SCENARIO.base.top_m + 0.5
    assert max(error for _, error, _ in poses) < 0.01
    assert max(turn for _, _, turn in poses) < 0.01
    assert all(all_finite(pose) for pose, _, _ in poses)


async def test_poses_are_true_with_the_drone_s_own_referee():
    async with served_link(SCENARIO) as link, watching(equipment(link)) as watched:
        await watched.until(lambda: watched.status() and watched.status()["figures"])
        poses = await fly_a_little(watched, link)
        assert watched.fleet.welcome()[0]["scenario"]["name"] == SCENARIO.name
        assert watched.fleet.video_url(1) == f"{link.drones[0]._video.url}video"
    assert max(error for _, error, _ in poses) < 0.01


async def test_north_is_x_without_any_source_of_placement(link):
    async with watching(equipment(link)) as watched:
        await watched.until_ready(link)
        with link.lock:
            pose, truth = watched.pose(), link.drones[0].simulation.truth
            origin_arena_m = link.drones[0].simulation.local_origin_arena_m
        x, y, z = truth.position_arena_m
        assert pose["p"] == pytest.approx(
            [x - origin_arena_m[0], y - origin_arena_m[1], z - origin_arena_m[2]], abs=0.01
        )
        assert watched.fleet.welcome()[0] == {
            "kind": "world",
            "scenario": None,
            "lift_m": 0.0,
            "source": "telemetry",
        }


async def test_the_status_has_all_fields_of_the_page(link):
    async with watching(equipment(link, SCENARIO)) as watched:
        await watched.until_ready(link)
        await asyncio.to_thread(link.advance, 2.0)
        status = watched.status()
        assert json.loads(json.dumps(status)) == status
        assert {**status, "link": None, "figures": None} == {
            "id": 1,
            "name": "drone 1",
            "mode": "Hold",
            "armed": False,
            "landed": True,
            "battery_percent": 100,
            "voltage_v": pytest.approx(12.6, abs=5.0),
            "link": None,
            "mission": None,
            "pilot": "",
            "figures": None,
            "video": False,
            "over": False,
        }
        assert status["link"]["state"] == "live"
        assert status["link"]["loss_percent"] == 0.0
        assert status["link"]["rate_hz"] > 300
        watched.fleet.set_pilot(1, "Ada")
        assert watched.status()["pilot"] == "Ada"


async def test_two_drones_are_kept_apart():
    scenarios = (SCENARIO, load_scenario("test-case-2"))
    link = SimulatedLink(*scenarios)
    async with watching(equipment(link)) as watched:
        await watched.until_ready(link, 1)
        await watched.until_ready(link, 2)
        assert watched.fleet.drone_ids() == [1, 2]
        assert [drone["id"] for drone in watched.fleet.pose_message()["drones"]] == [1, 2]
        ok, text = await watched.fleet.do(2, "arm")
        assert ok, text
        assert (watched.status(1)["armed"], watched.status(2)["armed"]) == (False, True)
    assert watched.notices()[:2] == ["drone 1 is heard", "drone 2 is heard"]


async def test_a_restart_is_reported_and_resets_all(link):
    async with watching(equipment(link, SCENARIO)) as watched:
        await fly_a_little(watched, link)
        link.restart()
        await watched.until(lambda: "drone 1 has restarted" in watched.notices())
        await watched.until_ready(link)
        with link.lock:
            assert error_m(link.drones[0], watched.pose()) < 0.01
        assert not watched.status()["armed"]
    assert watched.notices().count("drone 1 has restarted") == 1


async def test_a_silent_drone_is_stale_then_lost_then_back():
    link = SimulatedLink(SCENARIO)
    async with watching(equipment(link)) as watched:
        await watched.until(lambda: watched.pose() and watched.pose()["fresh"])
        link.muted = True
        await watched.until(lambda: watched.status()["link"]["state"] == "stale")
        assert not watched.pose()["fresh"]
        await watched.until(lambda: "drone 1: link lost" in watched.notices())
        assert watched.status()["link"]["state"] == "lost"
        link.muted = False
        await watched.until(lambda: watched.status()["link"]["state"] == "live")
        await watched.until(lambda: re.fullmatch(r"drone 1: link is back after \d+ s", watched.notices()[-1]))
    assert watched.notices().count("drone 1: link lost") == 1


async def test_silence_after_a_flight_is_no_lost_link():
    link = SimulatedLink(SCENARIO)
    async with watching(equipment(link)) as watched:
        await watched.until_ready(link)
        assert (await watched.fleet.do(1, "arm"))[0]
        assert not watched.status()["over"]
        assert (await watched.fleet.do(1, "disarm"))[0]
        await watched.until(lambda: watched.status()["over"])
        link.muted = True
        ended = "drone 1: not heard any more; its flight was over"
        await watched.until(lambda: ended in watched.notices())
        assert watched.status()["over"]
    assert "drone 1: link lost" not in watched.notices()


async def test_a_late_watcher_gets_the_history():
    link = SimulatedLink(SCENARIO, speed=10.0)  # as fast as it goes would be too few poses of a climb
    async with watching(equipment(link, SCENARIO)) as watched:
        await fly_a_little(watched, link)
        kinds = [message["kind"] for message in watched.fleet.welcome()]
        history = next(message for message in watched.fleet.welcome() if message["kind"] == "history")
        times = [row[0] for row in history["poses"]]
        heights = [row[3] for row in history["poses"]]
        assert times == sorted(set(times))
        assert max(heights) - min(heights) > 0.3
        assert kinds[-1] == "status"
        for message in (*watched.fleet.welcome(), watched.fleet.pose_message()):
            TypeAdapter(LiveMessage).validate_json(encode(message), extra="forbid")


async def test_a_link_that_fails_is_opened_again(link):
    async with watching(equipment(link)) as watched:
        await watched.until(watched.pose)
        link.fail("the cable was pulled")
        await watched.until(lambda: "the cable was pulled; trying again" in watched.notices())
        assert "the cable was pulled; trying again" in [
            message.get("text") for message in watched.fleet.welcome()
        ]
        await watched.until(lambda: link.opened >= 2)
        link.fail(None)
        await watched.until(lambda: any("is back after" in text for text in watched.notices()))
        assert watched.notices().count("the cable was pulled; trying again") == 1
        before = watched.pose()["t"]
        await watched.until(lambda: watched.pose()["t"] > before)


async def test_sticks_are_streamed_until_none_is_set(link):
    async with watching(equipment(link)) as watched:
        await watched.until(watched.pose)
        sent = lambda: [each for each in link.sent if each.get_type() == "MANUAL_CONTROL"]  # noqa: E731
        watched.fleet.sticks(1, Sticks(0.5, -0.25, 0.1, 1.0))
        await watched.until(lambda: len(sent()) >= 3)
        assert [(m.target, m.x, m.y, m.z, m.r) for m in sent()[:1]] == [(1, 500, -250, 550, 1000)]
        watched.fleet.sticks(1, Sticks(float("nan"), 9.0, -9.0, float("inf")))
        await watched.until(lambda: sent()[-1].x == 0)
        last = sent()[-1]
        assert (last.y, last.z, last.r) == (1000, 0, 0)
        watched.fleet.sticks(1, None)
        await asyncio.to_thread(link.advance, 0.1)  # what was on its way has gone
        count = len(sent())
        for _ in range(3):
            await asyncio.to_thread(link.advance, 1.0)
        assert len(sent()) == count


async def test_the_monitor_sends_a_heartbeat_a_second_and_few_requests(link):
    loop = asyncio.get_running_loop()
    async with watching(equipment(link)) as watched:
        began_s = loop.time()
        beats = lambda: [each for each in link.sent if each.get_type() == "HEARTBEAT"]  # noqa: E731
        await watched.until(lambda: len(beats()) >= 3)
        assert loop.time() - began_s >= 1.9
        assert (beats()[0].type, beats()[0].autopilot) == (6, 8)
    commands = [message for message in link.sent if message.get_type() == "COMMAND_LONG"]
    assert [(each.command, each.param1) for each in commands] == [(512, 2)]  # SYSTEM_TIME, once
