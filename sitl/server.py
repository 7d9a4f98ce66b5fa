"""The simulator as a program: a simulation in paced time, with MAVLink over UDP and video over HTTP."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from importlib import import_module
from typing import TYPE_CHECKING

from firmware_py.mavlink.links import GROUND, ONBOARD
from firmware_py.mavlink.node import MavlinkNode
from sitl.links import UdpAddresses, UdpLink, open_udp
from sitl.pacer import Pacer
from sitl.simulation import Simulation
from sitl.world import CONTROL_PERIOD_US

if TYPE_CHECKING:
    from sitl.camera_feed import CameraFeed
    from sitl.video import VideoServer

_BURST_TICKS = 25  # at most 0.1 s of simulated time before links and video get their turn
_NOTICE_PERIOD_S = 5.0


@dataclass(frozen=True, slots=True)
class ServerSettings:
    """Where the simulator listens and speaks, and how fast it runs.

    Attributes:
        instance: shifts all ports and the system id, as PX4's instances do.
        bind: address of all sockets.
        onboard_remote: host to which the onboard link (14540) speaks unasked.
        ground_remote: host to which the ground link (14550) speaks unasked.
        video_port: TCP port of the video; None for port 8080 plus instance.
        speed: simulated seconds a second.
    """

    instance: int = 0
    bind: str = "127.0.0.1"
    onboard_remote: str = "127.0.0.1"
    ground_remote: str = "127.0.0.1"
    video_port: int | None = None
    speed: float = 1.0

    @property
    def onboard(self) -> UdpAddresses:
        """The link for companion apps: PX4's 14580 to 14540."""
        i = self.instance
        return UdpAddresses((self.bind, 14580 + i), (self.onboard_remote, 14540 + i))

    @property
    def ground(self) -> UdpAddresses:
        """The link for ground stations: PX4's 18570 to 14550."""
        i = self.instance
        return UdpAddresses((self.bind, 18570 + i), (self.ground_remote, 14550 + i))

    @property
    def http_port(self) -> int:
        """TCP port of the video."""
        return 8080 + self.instance if self.video_port is None else self.video_port


class SimulatorServer:
    """Runs a simulation in real time.

    Args:
        simulation: what runs.
        settings: ports and speed.
        notice: called with lines for people: where it speaks once all is open, when it cannot keep up.
    """

    def __init__(
        self,
        simulation: Simulation,
        settings: ServerSettings,
        notice: Callable[[str], None] = lambda line: None,
    ) -> None:
        self._simulation = simulation
        self._settings = settings
        self._notice = notice
        self._node = MavlinkNode(
            simulation.autopilot,
            (ONBOARD, GROUND),
            system_id=settings.instance + 1,
            boot_unix_us=int(time.time() * 1e6),
        )
        self._links: dict[str, UdpLink] = {}
        self._camera: CameraFeed | None = None
        self._video: VideoServer | None = None

    async def run(self) -> None:
        """Open the links, then run until cancelled; video starts right after the first packets.

        Raises:
            LinkError: a UDP port is taken.
            VideoError: the TCP port is taken.
        """
        video_task: asyncio.Task[None] | None = None
        try:
            for profile, addresses in ((ONBOARD, self._settings.onboard), (GROUND, self._settings.ground)):
                self._links[profile.name] = await open_udp(addresses, self._receiver(profile.name))
            self._speak()
            await asyncio.to_thread(self._simulation.autopilot.prepare)
            video_task = asyncio.create_task(self._open_video())
            await self._run_paced(video_task)
        finally:
            if video_task is not None:
                video_task.cancel()
                await asyncio.gather(video_task, return_exceptions=True)
            if self._video is not None:
                await self._video.close()
            for link in self._links.values():
                link.close()

    def _receiver(self, name: str) -> Callable[[bytes], None]:
        def receive(data: bytes) -> None:
            self._node.receive(name, data)
            self._flush()  # answers do not wait for the next tick

        return receive

    def _speak(self) -> None:
        self._node.update(0)
        self._flush()

    def _flush(self) -> None:
        for name, data in self._node.take_output():
            self._links[name].send(data)

    async def _open_video(self) -> None:
        """Import what is heavy in a thread: telemetry must not wait for it."""
        await asyncio.to_thread(_import_video)
        from sitl.camera_feed import CameraFeed
        from sitl.video import VideoServer

        video = VideoServer(self._settings.bind, self._settings.http_port)
        video.add_json("/referee.json", self._referee_answer)
        await video.start()
        self._camera, self._video = CameraFeed(self._simulation.scenario), video
        self._notice(self._greeting())

    def _greeting(self) -> str:
        scenario, settings = self._simulation.scenario, self._settings
        ports = f"{settings.onboard.remote[1]} and {settings.ground.remote[1]}"
        page = f"http://{settings.bind}:{settings.http_port}/"
        return (
            f"{scenario.airframe} in {scenario.name}: MAVLink to UDP {ports}, video on {page} (Ctrl-C stops)"
        )

    def _referee_answer(self, query: Mapping[str, str]) -> object:
        """What `/referee.json?state=…&ended=…` tells: how the try stands, and the report if it ended now."""
        simulation = self._simulation
        referee = simulation.referee
        return {
            "scenario": simulation.scenario.name,
            "time_us": simulation.time_us,
            "snapshot": asdict(referee.snapshot()),
            "report": referee.report(query.get("state", ""), query.get("ended")).as_dict(),
        }

    def _publish_image(self) -> None:
        if self._camera is None or self._video is None:
            return
        arrived = self._camera.step(self._simulation.truth)
        if arrived is not None:
            time_us, image = arrived
            self._video.publish(image, time_us)

    async def _run_paced(self, video_task: asyncio.Task[None]) -> None:
        simulation, node, links = self._simulation, self._node, self._links
        pacer = Pacer(self._settings.speed, time.monotonic(), simulation.time_us)
        notices = _Notices(self._notice, self._settings.speed)
        while True:
            if video_task.done():
                video_task.result()  # a busy port ends the simulator
            target_us = pacer.target_us(time.monotonic())
            for _ in range(_BURST_TICKS):
                if simulation.time_us + CONTROL_PERIOD_US > target_us:
                    break
                simulation.tick()
                node.update(simulation.autopilot.state.time_us)
                for name, data in node.take_output():
                    links[name].send(data)
                self._publish_image()
            now_s = time.monotonic()
            notices.lag(pacer.give_up_lag(now_s, simulation.time_us), now_s)
            await asyncio.sleep(pacer.wait_s(now_s, simulation.time_us + CONTROL_PERIOD_US))


class _Notices:
    """Says, not too often, that the machine cannot keep up."""

    def __init__(self, say: Callable[[str], None], speed: float) -> None:
        self._say = say
        self._speed = speed
        self._since_s = time.monotonic()
        self._lost_s = 0.0

    def lag(self, lost_s: float, now_s: float) -> None:
        """Count wall seconds given up, and say so once a period."""
        self._lost_s += lost_s
        span_s = now_s - self._since_s
        if span_s < _NOTICE_PERIOD_S:
            return
        if self._lost_s > 0.0:
            reached = self._speed * (1.0 - self._lost_s / span_s)
            self._say(
                f"the machine cannot keep up: simulated time ran at {reached:.2f} of real time "
                f"(wanted {self._speed:g}) for the last {span_s:.0f} s; nothing was skipped"
            )
        self._since_s, self._lost_s = now_s, 0.0


def _import_video() -> None:
    for module in ("sitl.camera_feed", "aiohttp.web", "sitl.video"):
        import_module(module)
