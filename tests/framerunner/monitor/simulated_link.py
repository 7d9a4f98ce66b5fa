"""A link to real simulations and autopilots in this process: bytes as on the wire, no sockets.

    link = SimulatedLink(load_scenario("empty"))      # one drone, system 1, as fast as the machine can
    fleet = Fleet(equipment(link))                    # its thread makes time go by while it listens

`speed` says how time goes by: a number is simulated seconds a second, infinity is as fast as it goes, 0 only
with `advance`. `served_link` adds video and referee over HTTP. Whoever touches a simulation while somebody
listens does so within `with link.lock:`.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import asdict
from math import inf, isfinite

from firmware_py.mavlink.camera.model import FixedCamera, VideoEncoding, VideoStream
from firmware_py.mavlink.node import MavlinkNode, NodeOptions
from firmware_py.mavlink.telemetry.profiles import GROUND, ONBOARD
from framerunner.flying.plan import FlightPlan
from framerunner.monitor.ports import Equipment
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.mission_tunnel import COMPONENT_ID
from framerunner.wire.transports.urls import LinkError
from scenarios.loader import list_scenarios, load_scenario
from scenarios.models import Scenario, TrueState
from scenarios.task import Task
from sitl.camera import CameraFeed
from sitl.simulation import Simulation
from sitl.video import VideoServer
from sitl.world import CONTROL_PERIOD_US
from tests.node_input import deliver

_BURST_TICKS = 5  # 20 ms of simulated time at once
_TRUTHS = 5000  # 20 s
BOOT_UNIX_US = 1_700_000_000_000_000


class SimulatedDrone:
    """One drone behind the link.

    Attributes:
        simulation: what flies; another one after `restart`.
        node: what speaks for it.
        truths: its true states of the last 20 s by vehicle time in milliseconds.
        each_tick: called with the simulation before each tick; None: nobody.
    """

    def __init__(self, scenario: Scenario, system_id: int, video: VideoServer | None, *, pictures: bool):
        self.scenario, self.system_id, self.boots = scenario, system_id, 0
        self.truths: dict[int, TrueState] = {}
        self.each_tick: Callable[[Simulation], None] | None = None
        self._video = video
        self._feed = CameraFeed(scenario) if pictures and video is not None else None
        self._app = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=COMPONENT_ID)
        self.restart()
        if video is not None:
            video.add_json("/scenario.json", lambda _query: Task.of(scenario).model_dump(mode="json"))

    def restart(self) -> None:
        """Switch it off and on: it stands on its start, and its clock begins at 0."""
        self.simulation = Simulation(self.scenario)
        self.simulation.autopilot.prepare()
        self.truths.clear()
        streams = ()
        if self._video is not None:
            url = f"{self._video.url}video"
            streams = (VideoStream(url, VideoEncoding.MJPEG_HTTP, 320, 240, 10.0, 90.0),)
        self.node = MavlinkNode(
            self.simulation.autopilot,
            (GROUND, ONBOARD),
            NodeOptions(
                self.system_id,
                boot_unix_us=BOOT_UNIX_US + 1_000_000_000 * self.boots,
                video=streams,
                camera=FixedCamera(320, 240, 1.57, 10.0) if streams else None,
            ),
        )
        self.boots += 1

    def tick(self) -> list[bytes]:
        """Advance by one control period; returns its output to ground stations."""
        simulation = self.simulation
        if self.each_tick is not None:
            self.each_tick(simulation)
        sampled_us, truth = simulation.time_us, simulation.truth
        self.truths[sampled_us // 1000] = truth
        if len(self.truths) > _TRUTHS:
            del self.truths[next(iter(self.truths))]
        simulation.tick()
        self.node.update(sampled_us)
        if self._feed is not None and self._video is not None:
            arrived = self._feed.step(simulation.truth)
            if arrived is not None:
                self._video.publish(arrived[1], arrived[0])
        return self.output()

    def output(self) -> list[bytes]:
        """Its output to ground stations."""
        return [data for name, data in self.node.take_output() if name == GROUND.name]

    def hear_app(self, message: Message) -> None:
        """Take a message of the app on its onboard link."""
        deliver(self.node, ONBOARD.name, message.pack(self._app))
        self._app.seq = (self._app.seq + 1) % 256

    def referee_answer(self) -> dict[str, object]:
        """The content of the simulator's `/referee.json`."""
        simulation = self.simulation
        referee, origin_arena_m = simulation.referee, simulation.local_origin_arena_m
        return {
            "scenario": simulation.scenario.name,
            "source": "truth",
            "lift_m": 0.0,
            "time_us": simulation.time_us,
            "local_frame": origin_arena_m and {"origin_arena_m": origin_arena_m, "yaw_rad": 0.0},
            "snapshot": asdict(referee.snapshot()),
            "report": referee.report().as_json(),
        }


class SimulatedLink:
    """In place of a `VehicleLink`: to drones in this process; system ids count from 1.

    Attributes:
        drones: by place, 0 for system 1.
        lock: whoever touches a drone while somebody listens holds it.
        opened: how often `open` was called.
        sent: the latest messages of the listener.
        muted: nothing of the drones comes through, nor to them.
    """

    url = "simulated"
    host = "127.0.0.1"

    def __init__(
        self,
        *scenarios: Scenario,
        speed: float = inf,
        video: Sequence[VideoServer] = (),
        pictures: bool = False,
    ) -> None:
        servers = [*video, *[None] * (len(scenarios) - len(video))]
        self.drones = [
            SimulatedDrone(scenario, number + 1, servers[number], pictures=pictures)
            for number, scenario in enumerate(scenarios)
        ]
        self.lock = threading.RLock()
        self.opened = 0
        self.sent: deque[Message] = deque(maxlen=1000)
        self.muted = False
        self.camera_hosts = tuple(f"127.0.0.1:{server.port}" for server in video)
        self._speed = speed
        self._waiting: deque[bytes] = deque()
        self._granted_us = 0  # by `advance`, not gone by yet
        self._asked = threading.Condition(self.lock)
        self._last_s: float | None = None
        self._owed_us = 0.0
        self._problem: str | None = None
        self._listener = mavlink.MAVLink(None, srcSystem=250, srcComponent=190)
        self._parser = mavlink.MAVLink(None)
        self._parser.robust_parsing = True

    def open(self) -> SimulatedLink:
        """What `Equipment.open_link` calls; raises `LinkError` while the link is broken."""
        self.opened += 1
        if self._problem is not None:
            raise LinkError(self._problem)
        return self

    def receive(self, timeout_s: float) -> list[Message]:
        """Let some time pass; returns the messages sent meanwhile."""
        messages: list[Message] = []
        with self._asked:
            if self._problem is not None:
                raise LinkError(self._problem)
            self._deliver(messages)
            for _ in range(self._due_ticks()):
                for drone in self.drones:
                    self._parse(drone.tick(), messages)
                self._granted_us = max(0, self._granted_us - CONTROL_PERIOD_US)
            self._asked.notify_all()
            if not messages:
                self._asked.wait(min(timeout_s, 0.004))
        time.sleep(0.0001)  # others want the lock, too
        return messages

    def send(self, message: Message) -> None:
        """Send to the drones; received at the next `receive`."""
        with self.lock:
            self.sent.append(message)
            self._waiting.append(message.pack(self._listener))
            self._listener.seq = (self._listener.seq + 1) % 256

    def close(self) -> None:
        """Nothing to close."""

    def advance(self, seconds: float) -> None:
        """Let time pass and wait until the listener has taken all messages.

        Blocks, so call it as `await asyncio.to_thread(link.advance, 1.0)`.
        """
        with self._asked:
            self._granted_us += round(seconds * 1e6)
            while self._granted_us > 0:
                self._asked.wait()
            self._asked.wait()  # the listener is back, so it has passed on what it had

    def fail(self, problem: str | None) -> None:
        """Break the link, or repair it with None."""
        with self.lock:
            self._problem = problem
            self._last_s = None

    def restart(self, place: int = 0) -> None:
        """Switch a drone off and on."""
        with self.lock:
            self.drones[place].restart()

    def say_as_app(self, message: Message, place: int = 0) -> None:
        """Send a message as the app that flies a drone: component 191 of its system."""
        with self.lock:
            self.drones[place].hear_app(message)

    def _due_ticks(self) -> int:
        if self._granted_us > 0 or self._speed == inf:
            return _BURST_TICKS
        now_s = time.monotonic()
        passed_s = 0.0 if self._last_s is None else now_s - self._last_s
        self._last_s = now_s
        self._owed_us = min(self._owed_us + passed_s * self._speed * 1e6, 200_000.0)
        ticks = int(self._owed_us // CONTROL_PERIOD_US)
        self._owed_us -= ticks * CONTROL_PERIOD_US
        return ticks

    def _deliver(self, messages: list[Message]) -> None:
        while self._waiting:
            data = self._waiting.popleft()
            for drone in self.drones:
                if not self.muted:
                    deliver(drone.node, GROUND.name, data)
                self._parse(drone.output(), messages)

    def _parse(self, datagrams: list[bytes], messages: list[Message]) -> None:
        for data in datagrams:
            if not self.muted:
                messages += self._parser.parse_buffer(data) or ()


@asynccontextmanager
async def served_link(
    *scenarios: Scenario, speed: float = inf, pictures: bool = False
) -> AsyncIterator[SimulatedLink]:
    """A link whose drones serve video and referee over HTTP, on separate ports."""
    async with AsyncExitStack() as stack:
        servers = [VideoServer(port=0) for _ in scenarios]
        for server in servers:
            await server.start()
            stack.push_async_callback(server.close)
        link = SimulatedLink(*scenarios, speed=speed, video=servers, pictures=pictures)
        for server, drone in zip(servers, link.drones, strict=True):
            server.add_json("/referee.json", _answerer(link, drone))
        yield link


def _answerer(link: SimulatedLink, drone: SimulatedDrone) -> Callable[[object], object]:
    def answer(_query: object) -> object:
        with link.lock:
            return drone.referee_answer()

    return answer


def equipment(link: SimulatedLink, scenario: Scenario | None = None) -> Equipment:
    """What a monitor is given to watch these drones."""
    return Equipment(
        open_link=link.open,
        make_referee=lambda flown: FlightPlan(flown).new_referee(),
        scenario=scenario,
        list_scenarios=list_scenarios,
        load_scenario=load_scenario,
        runs=None,
        start_pose=lambda flown: FlightPlan(flown).start_pose,
        camera_hosts=link.camera_hosts,
    )


def all_finite(value: object) -> bool:
    """Whether no number anywhere in a JSON message is infinite or NaN."""
    if isinstance(value, dict):
        return all(all_finite(part) for part in value.values())
    if isinstance(value, list | tuple):
        return all(all_finite(part) for part in value)
    return not isinstance(value, float) or isfinite(value)
