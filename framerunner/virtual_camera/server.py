"""The virtual camera as a program: telemetry in, video and the referee's view out."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence

from framerunner.monitor.link_thread import LinkThread
from framerunner.virtual_camera.camera import VirtualCamera
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.session.session import RateWatch, Session, pose_rates
from framerunner.wire.simulator_api import REFEREE_PATH, SCENARIO_PATH
from framerunner.wire.transports.vehicle_link import VehicleLink
from framerunner.wire.vehicle_telemetry import VehicleTelemetry
from scenarios.task import Task
from sitl.video import VideoServer

STALE_S = 0.5  # wall time without attitude or position, after which no image is served
SYSTEM_ID = 246  # MAVSDK has 245, ground stations 255
COMPONENT_ID = mavlink.MAV_COMP_ID_ONBOARD_COMPUTER
WANTED_HZ = 50.0
ENOUGH = 0.8  # share of that
_MAX_RATE_REQUESTS = 5
_UPDATE_S = 0.1
_RATE_PERIOD_S = 2.0
_WAITING_LINE_S = 10.0

Say = Callable[[str], None]
"""Called with lines for people."""


class CameraServer:
    """Reads a vehicle's telemetry from a link, which is closed at the end; serves the rendered images."""

    def __init__(
        self,
        camera: VirtualCamera,
        link: VehicleLink,
        video: VideoServer,
        say: Say,
        *,
        show_layout: bool = False,
    ) -> None:
        self._show_layout = show_layout
        self._camera = camera
        self._link = link
        self._video = video
        self._say = say
        self._watch = _TelemetryWatch(say, link.url, camera.telemetry)
        # Over udpout the vehicle cannot send before it has received something.
        self._session = Session(heartbeat="companion", telemetry=camera.telemetry)
        self._thread = LinkThread(lambda: link, self._take, lambda _level, text: say(text), reopens=False)
        self._rates = _new_rates()
        self._restarts = 0
        self._has_gimbal = False

    async def run(self) -> None:
        """Serve until cancelled.

        Raises:
            VideoError: the TCP port is in use.
            LinkError: the link failed.
        """
        self._video.add_json(REFEREE_PATH, self._referee_answer)
        scenario = self._camera.plan.scenario
        task = Task.of(scenario, show_layout=self._show_layout)
        self._video.add_json(SCENARIO_PATH, lambda _query: task.model_dump(mode="json"))
        updates: asyncio.Task[None] | None = None
        try:
            await self._video.start()
            self._say(
                f"camera of {scenario.name}: video on {self._video.url} (Ctrl-C stops); "
                f"listening for a vehicle on {self._link.url}"
            )
            updates = asyncio.create_task(self._update_forever())
            await self._thread.run()
        finally:
            if updates is not None:
                updates.cancel()
            await self._video.close()
            self._link.close()

    def _take(self, messages: Sequence[Message], _host: str) -> None:
        session = self._session
        for message in messages:
            is_found, now_s = session.system_id is not None, time.monotonic()
            session.take(message, now_s)
            if session.system_id is not None and not is_found:
                self._say(f"vehicle {session.system_id} found")
            is_gimbals = message.get_type() == "GIMBAL_DEVICE_ATTITUDE_STATUS"
            if is_gimbals and message.get_srcSystem() == session.system_id:
                self._camera.take_gimbal(message)
            elif session.is_from_autopilot(message):
                self._camera.follow(message)
        if self._camera.restarts != self._restarts:
            self._restarts = self._camera.restarts
            self._rates = _new_rates()
            self._say("the vehicle has restarted; the arena is placed again")
        self._watch.report_placement(self._camera)
        if self._camera.has_gimbal is not self._has_gimbal:
            self._has_gimbal = self._camera.has_gimbal
            self._say(
                "the camera looks as the vehicle's gimbal" if self._has_gimbal else "the gimbal is lost"
            )
        shot = self._camera.step()
        if shot is not None and not self._watch.stale:
            self._video.publish(shot[1], shot[0])

    async def _update_forever(self) -> None:
        """Send heartbeats, request rates, and report telemetry that is no longer received."""
        while True:
            now_s = time.monotonic()
            for message in self._session.due(now_s):
                self._thread.send(message)
            self._watch.check(now_s)
            if self._session.system_id is not None:
                self._request_rates(self._session.system_id, now_s)
            await asyncio.sleep(_UPDATE_S)

    def _request_rates(self, vehicle: int, now_s: float) -> None:
        """Request higher rates where they are too low; after some requests, report the low rates."""
        rates = self._rates
        requests = rates.requests(vehicle, self._session.stream_counts, now_s)
        if requests and not rates.left:
            attitude_hz, position_hz = rates.rates_hz.values()
            self._say(
                f"attitude is received at {attitude_hz:.0f} Hz and position at {position_hz:.0f} Hz, less "
                f"than the {WANTED_HZ:.0f} Hz requested; the video is no smoother than that"
            )
        else:
            for request in requests:
                self._session.send(request)

    def _referee_answer(self, query: Mapping[str, str]) -> object:
        return self._camera.standing(query.get("state", ""), query.get("ended")).model_dump(mode="json")


def _new_rates() -> RateWatch:
    """Of one boot; instead of the last request it is said that they are low."""
    return pose_rates(WANTED_HZ, ENOUGH, _RATE_PERIOD_S, time.monotonic(), _MAX_RATE_REQUESTS + 1)


class _TelemetryWatch:
    """Says once what is missing and once when it is received again."""

    def __init__(self, say: Say, url: str, telemetry: VehicleTelemetry) -> None:
        self._say = say
        self._url = url
        self._telemetry = telemetry
        self._began_s = time.monotonic()
        self._waiting_said = False
        self._placed: bool | None = None
        self.stale = False  # attitude or position is no longer received

    def check(self, now_s: float) -> None:
        """Say what has not been received for too long, or is received again."""
        telemetry = self._telemetry
        heard_s = {"attitude": telemetry.attitude_heard_s, "local position": telemetry.position_heard_s}
        missing = [name for name, at_s in heard_s.items() if now_s - max(at_s, self._began_s) > STALE_S]
        words = " and no ".join(missing)
        if min(heard_s.values()) < self._began_s:
            if missing and not self._waiting_said and now_s - self._began_s > _WAITING_LINE_S:
                self._waiting_said = True
                self._say(f"still no {words} on {self._url}; no images until they are received")
            return
        if missing and not self.stale:
            self._say(f"no {words} for {STALE_S:g} s; no new images until they are back")
        if self.stale and not missing:
            self._say("telemetry is back")
        self.stale = bool(missing)

    def report_placement(self, camera: VirtualCamera) -> None:
        """Say when the arena is placed, or why it is not."""
        placement = camera.placement
        placed = placement.alignment is not None
        if placed == self._placed or not (placed or placement.armed):
            return
        self._placed = placed
        self._say(
            "the arena is placed: the vehicle stands on the start, with the start's heading"
            if placed
            else "the arena is not placed yet: the vehicle must stand disarmed on its start"
        )
