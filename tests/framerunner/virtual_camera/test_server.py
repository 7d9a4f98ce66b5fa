"""The virtual camera as a program: what it serves, requests and says."""

import asyncio
import threading
import time
from contextlib import asynccontextmanager, suppress

import aiohttp
import pytest

from framerunner.virtual_camera.camera import VirtualCamera
from framerunner.virtual_camera.server import CameraServer
from framerunner.wire.dialect import mavlink
from framerunner.wire.transports.urls import LinkError
from scenarios.loader import load_scenario
from scenarios.task import Task
from sitl.video import VideoServer
from tests.waiting import until

SCENARIO = load_scenario("test-case-1")


class Link:
    """A vehicle at rest on a wire, two hundredths of a second between its reports."""

    url = "a wire"
    host = ""

    def __init__(self, *, armed=False):
        self.armed, self.mute, self.broken, self.closed = armed, False, False, False
        self.sent = []
        self._time_ms = 5_000
        self._codec = mavlink.MAVLink(None, srcSystem=3, srcComponent=1)
        self._reader = mavlink.MAVLink(None)
        self._lock = threading.Lock()

    def receive(self, timeout_s):
        if self.broken:
            raise LinkError("a wire failed: cut")
        if self.mute:
            time.sleep(timeout_s)
            return []
        time.sleep(0.005)
        self._time_ms += 20
        heartbeat = mavlink.MAVLink_heartbeat_message(2, 12, 128 * self.armed, 0, 3, 3)
        out = [
            mavlink.MAVLink_attitude_message(self._time_ms, 0, 0, 0.3, 0, 0, 0),
            mavlink.MAVLink_local_position_ned_message(self._time_ms, 1, 2, 3, 0, 0, 0),
            *([heartbeat] if self._time_ms % 1000 == 0 else []),
        ]
        return [self._reader.parse_buffer(message.pack(self._codec))[0] for message in out]

    def send(self, message):
        with self._lock:
            self.sent.append(message)

    def close(self):
        self.closed = True


@asynccontextmanager
async def serving(link):
    said = []
    video = VideoServer(port=0)
    server = CameraServer(VirtualCamera(SCENARIO), link, video, said.append)
    running = asyncio.create_task(server.run())
    try:
        await until(lambda: said or running.done())
        yield video, said, running
    finally:
        running.cancel()
        with suppress(asyncio.CancelledError, LinkError):
            await running
        assert link.closed


async def test_serves_images_and_the_referee_while_telemetry_is_received():
    link = Link()
    async with serving(link) as (video, said, _), aiohttp.ClientSession() as session:
        await until(lambda: any("the arena is placed" in line for line in said))
        status = 503
        while status == 503:
            async with session.get(f"{video.url}image.jpg") as response:
                status = response.status
            await asyncio.sleep(0.01)
        assert status == 200
        async with session.get(f"{video.url}referee.json") as response:
            answer = await response.json()
        assert (answer["scenario"], answer["source"], answer["lift_m"]) == ("test-case-1", "telemetry", 0.0)
        assert len(answer["local_frame"]["origin_arena_m"]) == 3
        async with session.get(f"{video.url}scenario.json") as response:
            assert await response.json() == Task.of(SCENARIO).model_dump(mode="json")
        link.mute = True
        await until(lambda: any("no new images" in line for line in said))
        link.mute = False
        await until(lambda: said[-1] == "telemetry is back")
        assert sum("no new images" in line for line in said) == 1
    assert {message.get_type() for message in link.sent} <= {"HEARTBEAT", "COMMAND_LONG"}
    assert all(message.type == mavlink.MAV_TYPE_ONBOARD_CONTROLLER for message in link.sent[:1])


async def test_it_says_that_a_flying_vehicle_must_be_put_on_its_start():
    async with serving(Link(armed=True)) as (_, said, _):
        await until(lambda: any("must stand disarmed on its start" in line for line in said))


async def test_a_link_that_fails_ends_it_in_one_line():
    link = Link()
    async with serving(link) as (_, said, running):
        await until(lambda: any("vehicle 3 found" in line for line in said))
        link.broken = True
        with pytest.raises(LinkError, match="a wire failed: cut"):
            await running
