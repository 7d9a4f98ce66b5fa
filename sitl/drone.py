"""One drone of the server: its simulation, its links and its video."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from math import degrees
from typing import TYPE_CHECKING

from firmware_py.mavlink.camera.model import CameraModel, VideoEncoding, VideoStream
from firmware_py.mavlink.node import MavlinkNode, NodeOptions
from geometry.solids import Solid
from scenarios.result import LocalFrame, Standing
from sitl.drone_files import flight_recorder
from sitl.link_hub import LinkHub
from sitl.parameter_file import ParameterKeeper, open_parameters
from sitl.payload.album import CameraAlbum
from sitl.server_settings import ServerSettings
from sitl.simulation import Simulation
from sitl.storage import open_storage
from sitl.time_grants import TimeGrants, Velocity
from sitl.world import CONTROL_PERIOD_US
from wire.dialect import mavlink
from wire.simulator_api import REFEREE_PATH, SCENARIO_PATH, VIDEO_PATH
from wire.transports.urls import is_loopback

if TYPE_CHECKING:
    from sitl.camera import CameraFeed
    from sitl.faults.images import FaultyFeed
    from sitl.rtp import RtpSender
    from sitl.video import VideoServer


class ServedDrone:
    """Puts one simulation on MAVLink and video; it advances when `tick` is called.

    Args:
        simulation: of the drone.
        settings: of this drone.
        boot_unix_us: time now, microseconds since 1970.
        notice: called with lines for people.

    Raises:
        StorageFolderError: the folder for its files cannot be used.
        ParameterFileError: the file of its parameters cannot be read, or a line is wrong.

    Attributes:
        simulation: as given.
        node: its MAVLink services.
    """

    def __init__(
        self,
        simulation: Simulation,
        settings: ServerSettings,
        boot_unix_us: int,
        notice: Callable[[str], None] = lambda line: None,
    ) -> None:
        self.simulation = simulation
        self._settings = settings
        self._keeper: ParameterKeeper | None = None
        if settings.parameters is not None:
            self._keeper = open_parameters(simulation.autopilot.parameters, settings.parameters, notice)
        storage = open_storage(settings.storage, settings.instance)
        camera = simulation.scenario.camera
        model = CameraModel(camera.width_px, camera.height_px, camera.horizontal_fov_rad, camera.rate_hz)
        self._album = CameraAlbum(storage, boot_unix_us, camera.rate_hz)
        self._recorder = flight_recorder(storage, boot_unix_us)
        self.node = MavlinkNode(
            simulation.autopilot,
            options=NodeOptions(
                system_id=settings.instance + 1,
                boot_unix_us=boot_unix_us,
                signing_key=settings.signing_key,
                video=self._streams(),
                storage=storage,
                shell=settings.shell,
                log_text=self._recorder.hear_text,
                camera=model if settings.camera else None,
                captures=self._album,
                switch_video=self._switch_rtp,
                gimbal=simulation.gimbal,
                gripper=simulation.scenario.gripper,
                failures=simulation.faults,
                truth=simulation.true_state,
            ),
        )
        self._notice = simulation.faults.notice = notice
        self._hub = LinkHub(self.node, self._warn, lambda: simulation.faults.link)
        self._camera: CameraFeed | FaultyFeed | None = None
        self._video: VideoServer | None = None
        self._rtp: RtpSender | None = None
        self._rtp_sends = True
        self._image_us = -1

    async def open_links(self) -> None:
        """Open the links and send at once.

        Raises:
            LinkError: one cannot be opened.
        """
        for profile, addresses in self._settings.default_links:
            await self._hub.open_udp(profile, addresses)
        if self._settings.payload is not None:
            await self._hub.open_payload(*self._settings.payload)
        self._hub.update(0)
        if self._keeper is not None:
            self._keeper.start()
        for link in self._settings.links:
            await self._hub.open(link)

    async def open_video(self, others: Callable[[], Sequence[Solid]] = tuple) -> None:
        """Import large libraries in a thread, as telemetry must not wait, then serve the camera's images.

        Args:
            others: called at each exposure for the boxes of other drones.

        Raises:
            VideoError: a port is in use or an address is wrong.
        """
        for module in ("sitl.camera", "aiohttp.web", "sitl.video"):
            await asyncio.to_thread(import_module, module)
        from sitl.faults.images import new_feed
        from sitl.video import VideoServer

        simulation, scenario = self.simulation, self.simulation.scenario
        video = VideoServer(
            self._settings.bind, self._settings.http_port, options="--instance (sim also: --video-port)"
        )
        video.add_json(REFEREE_PATH, self._referee_answer)
        video.add_json(SCENARIO_PATH, lambda _query: scenario.model_dump(mode="json"))
        if self._settings.video_rtp is not None:
            await asyncio.to_thread(import_module, "sitl.rtp")
            from sitl.rtp import RtpSender

            self._rtp = RtpSender(self._settings.video_rtp, scenario.camera, self._settings.speed)
            video.add_text("/video.sdp", "application/sdp", self._rtp.description())
        self._video = video
        await video.start()
        self._camera = new_feed(scenario, simulation.faults, simulation.seed, others)

    def _switch_rtp(self, on: bool) -> None:  # the interface's
        self._rtp_sends = on

    def _warn(self, line: str) -> None:
        """Show a line at the terminal and at ground stations."""
        self._notice(line)
        self.simulation.autopilot.say(mavlink.MAV_SEVERITY_WARNING, line)

    def tick(self) -> None:
        """Advance by one control period, then serve the log, the links and the video."""
        simulation = self.simulation
        # Not the estimate's time, which does not advance while sensors are unusable.
        sampled_us = simulation.time_us
        simulation.tick()
        self._recorder.update(simulation.autopilot)
        self._hub.update(sampled_us)
        if self._camera is None or self._video is None:
            return
        arrived = self._camera.step(simulation.truth)
        if arrived is not None:
            time_us, image = arrived
            self._image_us = time_us
            self._video.publish(image, time_us)
            self._album.show(image, time_us)
            if self._rtp is not None and self._rtp_sends:
                self._rtp.send(image, time_us)

    async def hold(self, grants: TimeGrants) -> None:
        """Wait until simulated time may advance."""

        def received() -> Velocity | None:
            self._hub.read()  # on a flooded link, a setpoint may still wait
            return self.simulation.autopilot.setpoints.newest_velocity()

        await grants.hold(self.simulation.time_us - CONTROL_PERIOD_US, self._image_us, received)

    async def close(self) -> None:
        """Finish the log, save the parameters, stop the video and close the links."""
        self._recorder.finish(self.simulation.autopilot)
        self._album.stop_video()
        if self._keeper is not None:
            await self._keeper.close()
        if self._video is not None:
            await self._video.close()
        if self._rtp is not None:
            await asyncio.to_thread(self._rtp.close)
        self._hub.close()

    def greeting(self) -> str:
        """One line for people: airframe, scenario and addresses."""
        scenario, settings = self.simulation.scenario, self._settings
        assert settings.onboard.remote is not None
        assert settings.ground.remote is not None
        ports = f"{settings.onboard.remote[1]} and {settings.ground.remote[1]}"
        page = f"http://{settings.bind}:{settings.http_port}/"
        rtp = "" if settings.video_rtp is None else f" and as RTP to UDP {settings.video_rtp[1]}"
        return f"{scenario.airframe} in {scenario.name}: MAVLink to UDP {ports}, video on {page}{rtp}"

    def _streams(self) -> tuple[VideoStream, ...]:
        """The video streams that the camera component offers; QGroundControl takes the first it can show."""
        settings, camera = self._settings, self.simulation.scenario.camera
        common = (camera.width_px, camera.height_px, camera.rate_hz, degrees(camera.horizontal_fov_rad))
        host = _public_address(settings)
        page = VideoStream(
            f"http://{host}:{settings.http_port}{VIDEO_PATH}", VideoEncoding.MJPEG_HTTP, *common
        )
        if settings.video_rtp is None:
            return (page,)
        return (VideoStream(str(settings.video_rtp[1]), VideoEncoding.H264_RTP, *common), page)

    def _referee_answer(self, query: Mapping[str, str]) -> object:
        """`/referee.json?state=…&ended=…`: how the try stands, and the report if it ended now."""
        simulation = self.simulation
        referee = simulation.referee
        origin_arena_m = simulation.local_origin_arena_m
        standing = Standing(
            scenario=simulation.scenario.name,
            source="truth",
            time_us=simulation.time_us,
            local_frame=None if origin_arena_m is None else LocalFrame(origin_arena_m=origin_arena_m),
            snapshot=referee.snapshot(),
            report=referee.report(query.get("state", ""), query.get("ended")),
            faults=simulation.fault_facts(),
        )
        return standing.model_dump(mode="json")


def _public_address(settings: ServerSettings) -> str:
    """The address under which a ground station reaches this machine, when all addresses are listened on."""
    if settings.bind != "0.0.0.0":
        return settings.bind
    remote = settings.ground.remote
    if remote is None or is_loopback(remote[0]):
        return "127.0.0.1"
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(remote)  # sends nothing; the system chooses the route
            return str(probe.getsockname()[0])
        except OSError:
            return "127.0.0.1"
