"""One drone's camera images, referee and scenario over HTTP, and its video as RTP."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING

from framerunner.geometry.rotations import rotation, yaw_of
from framerunner.geometry.solids import Solid
from framerunner.wire.simulator_api import REFEREE_PATH, SCENARIO_PATH
from scenarios.models import TrueState
from scenarios.result import LocalFrame, Standing, StandingPlace
from scenarios.task import Task
from sitl.server_settings import ServerSettings
from sitl.vehicle import SimulatedVehicle

if TYPE_CHECKING:
    from sitl.camera import CameraFeed
    from sitl.pacing.time_grants import TimeGrants
    from sitl.streaming.rtp import RtpSender
    from sitl.video import Image, VideoServer

_UPRIGHT = 0.98  # cosine of the tilt


class DroneVideo:
    """Serves a drone's images and its referee once it is open.

    Args:
        simulation: of the drone.
        settings: of this drone.
        grants: the program that grants time gets the images without compression; None: there is none.

    Attributes:
        image_us: time of exposure of the image that was sent last; negative before the first.
        sends_rtp: images are sent as RTP, if that was set up.
    """

    def __init__(
        self, simulation: SimulatedVehicle, settings: ServerSettings, grants: TimeGrants | None = None
    ) -> None:
        self.image_us = -1
        self.sends_rtp = True
        self._simulation, self._settings, self._grants = simulation, settings, grants
        self._camera: CameraFeed | None = None
        self._video: VideoServer | None = None
        self._rtp: RtpSender | None = None
        self._others: Callable[[], Sequence[Solid]] = tuple

    async def open(self, others: Callable[[], Sequence[Solid]] = tuple) -> None:
        """Import large libraries in a thread, as telemetry must not wait, then serve the camera's images.

        Args:
            others: called at each exposure for the boxes of other drones.

        Raises:
            VideoError: a port is in use or an address is wrong.
        """
        for module in ("sitl.camera", "aiohttp.web", "sitl.video"):
            await asyncio.to_thread(import_module, module)
        from sitl.video import VideoServer

        scenario = self._simulation.scenario
        video = VideoServer(
            self._settings.bind, self._settings.http_port, options="--instance (sim also: --video-port)"
        )
        video.add_json(REFEREE_PATH, self._referee_answer)
        task = Task.of(scenario, show_layout=self._settings.show_layout)
        video.add_json(SCENARIO_PATH, lambda _query: task.model_dump(mode="json"))
        if self._settings.video_rtp is not None:
            await asyncio.to_thread(import_module, "sitl.streaming.rtp")
            from sitl.streaming.rtp import RtpSender

            self._rtp = RtpSender(self._settings.video_rtp, scenario.camera, self._settings.speed)
            video.add_text("/video.sdp", "application/sdp", self._rtp.description())
        self._video = video
        await video.start()
        self._others = others
        self.show(self._simulation)

    def show(self, simulation: SimulatedVehicle) -> None:
        """Serve this simulation of the same scenario from now on."""
        from sitl.faults.images import new_feed

        self._simulation = simulation
        self.image_us = -1
        self._camera = new_feed(simulation.scenario, simulation.faults, simulation.seed, self._others)

    def step(self) -> Image | None:
        """Take the true state now; returns the image that was sent, if one has arrived."""
        if self._camera is None or self._video is None:
            return None
        arrived = self._camera.step(self._simulation.truth)
        if arrived is None:
            return None
        time_us, image = arrived
        self.image_us = time_us
        self._video.publish(image, time_us)
        if self._grants is not None:
            self._grants.send_image(image, time_us)
        if self._rtp is not None and self.sends_rtp:
            self._rtp.send(image, time_us)
        return image

    async def close(self) -> None:
        """Stop serving."""
        if self._video is not None:
            await self._video.close()
        if self._rtp is not None:
            await asyncio.to_thread(self._rtp.close)

    def _referee_answer(self, query: Mapping[str, str]) -> object:
        """`/referee.json?state=…&ended=…`: how the try stands, and the report if it ended now."""
        simulation = self._simulation
        referee = simulation.referee
        origin_arena_m = simulation.local_origin_arena_m
        standing = Standing(
            scenario=simulation.scenario.name,
            source="truth",
            time_us=simulation.time_us,
            local_frame=None if origin_arena_m is None else LocalFrame(origin_arena_m=origin_arena_m),
            stands_at=standing_place(simulation.truth),
            snapshot=referee.snapshot(),
            report=referee.report(query.get("state", ""), query.get("ended")),
            faults=simulation.fault_facts(),
        )
        return standing.model_dump(mode="json")


def standing_place(truth: TrueState) -> StandingPlace | None:
    """Where a drone stands; None if it flies, or lies on its side."""
    if truth.motors_on or rotation(truth.attitude_arena)[8] < _UPRIGHT:
        return None
    return StandingPlace(position_arena_m=truth.position_arena_m, yaw_rad=yaw_of(truth.attitude_arena))
