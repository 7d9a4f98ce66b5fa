import asyncio
import json
import math
from types import SimpleNamespace

import pytest

from framerunner.monitor import FIRST_VIEWER
from framerunner.monitor.channel import ChannelEndError
from framerunner.monitor.live_channel import MAX_PENDING, LiveChannel, Viewer, encode
from tests.framerunner.monitor.serving import StubFleet, browser, serving


def viewer_of(kinds=()):
    return Viewer(SimpleNamespace(scope={}), kinds)


def kinds(viewer):
    async def take():
        return [json.loads(await viewer.next())["kind"] for _ in range(pending(viewer))]

    return take()


def pending(viewer):
    return len(viewer._events) + len(viewer._newest)


def test_numbers_are_rounded_and_finite():
    text = encode({"kind": "pose", "drones": [{"p": [0.123456789, math.nan, -math.inf], "s": 3}]})
    assert json.loads(text) == {"kind": "pose", "drones": [{"p": [0.1235, None, None], "s": 3}]}
    figures = {"kind": "status", "total_time_s": 43.123456789, "limit": math.inf}
    assert json.loads(encode(figures)) == {"kind": "status", "total_time_s": 43.123456789, "limit": None}


async def test_the_welcome_comes_first_and_events_before_poses():
    fleet = StubFleet()
    channel, viewer = LiveChannel(fleet), viewer_of()
    channel.enter(viewer)
    channel.send(fleet.pose_message())
    channel.send({"kind": "text", "id": 1, "text": "hello"})
    assert await kinds(viewer) == ["world", "text", "status", "pose"]


async def test_only_the_newest_pose_waits_and_each_drone_has_its_own_detections():
    fleet = StubFleet()
    channel, viewer = LiveChannel(fleet), viewer_of(["pose", "detections"])
    channel.enter(viewer)
    for _ in range(100):
        channel.send(fleet.pose_message())
        for drone_id in (1, 2):
            channel.send({"kind": "detections", "id": drone_id})
    assert pending(viewer) == 3
    assert json.loads(await viewer.next())["drones"][0]["t"] == 100.0


async def test_a_viewer_with_too_many_waiting_events_is_dropped():
    channel, slow, other = LiveChannel(StubFleet()), viewer_of(["text"]), viewer_of(["text"])
    channel.enter(slow)
    channel.enter(other)
    for number in range(MAX_PENDING + 1):
        channel.send({"kind": "text", "id": 1, "text": str(number)})
        assert json.loads(await other.next())["text"] == str(number)
    with pytest.raises(ChannelEndError, match="does not keep up"):
        await slow.next()


async def test_no_poses_are_made_without_viewers(monkeypatch):
    async with serving(monkeypatch) as served, browser() as client:
        assert served.fleet.ticks == 0
        async with client.ws_connect(served.url + "ws/live") as live:
            while (await live.receive_json())["kind"] != "pose":
                pass
        async with asyncio.timeout(10):
            seen = -1
            while seen != served.fleet.ticks:  # the server has noticed that the viewer went
                seen = served.fleet.ticks
                await asyncio.sleep(0.2)


async def test_the_first_viewer_is_told_once(monkeypatch):
    async with serving(monkeypatch) as served, browser() as client:
        assert FIRST_VIEWER not in served.lines
        for _ in range(2):
            async with client.ws_connect(served.url + "ws/live") as live:
                await live.receive_json()
        assert served.lines.count(FIRST_VIEWER) == 1


async def watch(client, url, seconds):
    """Return when each pose came and what it was."""
    loop = asyncio.get_running_loop()
    poses = []
    async with client.ws_connect(url) as live:
        assert (await live.receive_json())["kind"] == "world"
        end_s = loop.time() + seconds
        while loop.time() < end_s:
            message = await live.receive_json()
            if message["kind"] == "pose":
                poses.append((loop.time(), message["drones"][0]["t"]))
    return poses


async def test_ten_viewers_get_every_pose_at_once(monkeypatch):
    async with (
        serving(monkeypatch) as served,
        browser() as client,
        client.ws_connect(served.url + "ws/live"),
    ):  # reads nothing, and must not delay the others
        watching = [watch(client, served.url + "ws/live", 1.5) for _ in range(10)]
        seen = await asyncio.gather(*watching)
    for poses in seen:
        numbers = [number for _, number in poses]
        # None is left out, so whatever the machine's load they came as fast as they were made.
        assert numbers == list(range(int(numbers[0]), int(numbers[0]) + len(numbers)))


async def test_a_page_may_request_some_kinds_only(monkeypatch):
    async with serving(monkeypatch) as served, browser() as client:
        async with client.ws_connect(served.url + "ws/live?kinds=status,text") as live:
            assert (await live.receive_json())["kind"] == "status"
            served.fleet.hearers[0]({"kind": "text", "id": 1, "text": "hello"})
            async with asyncio.timeout(10):
                while (message := await live.receive_json())["kind"] != "text":
                    assert message["kind"] == "status"
        assert message["text"] == "hello"


async def test_too_many_viewers_are_refused(monkeypatch):
    monkeypatch.setattr("framerunner.monitor.live_channel.MAX_VIEWERS", 1)
    async with (
        serving(monkeypatch) as served,
        browser() as client,
        client.ws_connect(served.url + "ws/live") as first,
    ):
        await first.receive_json()
        async with client.ws_connect(served.url + "ws/live") as second:
            await second.receive()
            assert second.close_code == 1013


async def test_a_fault_in_one_message_does_not_stop_the_next(monkeypatch):
    async with serving(monkeypatch) as served, browser() as client:
        make = served.fleet.pose_message

        def sometimes():
            message = make()
            if served.fleet.ticks == 2:
                raise ValueError("a fault")
            return message

        served.fleet.pose_message = sometimes
        async with asyncio.timeout(20):
            poses = await watch(client, served.url + "ws/live", 0.5)
            assert [number for _, number in poses[:2]] in ([1.0, 3.0], [3.0, 4.0])


@pytest.mark.parametrize("text", ["hello", "x" * 100_000])
async def test_messages_of_a_browser_are_ignored(monkeypatch, text):
    async with (
        serving(monkeypatch) as served,
        browser() as client,
        client.ws_connect(served.url + "ws/live") as live,
    ):
        await live.send_str(text)
        async with asyncio.timeout(10):
            while (await live.receive_json())["kind"] != "pose":
                pass


async def test_a_late_viewer_gets_the_history_and_the_next_one_its_new_samples():
    fleet, welcome = StubFleet(), {"kind": "history", "id": 1, "poses": [[0.1, 1.0, None]]}
    fleet.welcome = lambda: [welcome]
    channel = LiveChannel(fleet)
    for rows in ([[0.1, 1.0, None]], [[0.1, 1.0, None], [0.2, 2.0, None]], []):
        welcome["poses"] = rows
        viewer, other = viewer_of(["history"]), viewer_of(["pose"])
        channel.enter(viewer)
        channel.enter(other)
        assert json.loads(await viewer.next())["poses"] == rows
        assert pending(other) == 0
