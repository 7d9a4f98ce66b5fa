"""The simulator's HTTP API: video for browsers, `cv2.VideoCapture` and the navigator, and JSON documents.

`/video` is a stream of JPEG images, each with the vehicle time of its exposure in the header `X-Time-Us`;
`/image.jpg` is the latest one, `/` a page that shows the stream. An image is compressed when the first
client requests it, and once for all of them. There is no backlog: a slow client misses images.

`DroneVideo` serves one simulated drone's camera, referee and scenario, and sends its video as RTP.
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from socket import SO_SNDBUF, SOL_SOCKET
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from framerunner.geometry.rotations import rotation, yaw_of
from framerunner.wire.finite_json import finite
from framerunner.wire.mjpeg import STREAM_HEADERS, STREAM_START, write_part
from framerunner.wire.simulator_api import REFEREE_PATH, SCENARIO_PATH, VIDEO_PATH
from framerunner.wire.transports.urls import in_url
from scenarios.result import LocalFrame, Standing, StandingPlace
from scenarios.task import Task
from sitl.streaming.streams import VideoError

if TYPE_CHECKING:
    from aiohttp import web

    from framerunner.geometry.solids import Solid
    from scenarios.models import TrueState
    from sitl.camera import CameraFeed
    from sitl.pacing.time_grants import TimeGrants
    from sitl.server_settings import ServerSettings
    from sitl.streaming.h264 import RtpSender
    from sitl.vehicle import SimulatedVehicle

Image = npt.NDArray[np.uint8]
_UPRIGHT = 0.98  # cosine of the tilt of a drone that stands
JsonProvider = Callable[[Mapping[str, str]], object]

JPEG_QUALITY = 98  # of 3138 boxes none differs from the raw image's; at 95, 39 do, by a pixel
_SEND_BUFFER_BYTES = 1 << 16  # the kernel would buffer seconds of video for a slow client
_CLOSE_S = 1.0
_PAGE = """<!doctype html>
<html lang="en">
<title>framerunner camera</title>
<style>body{margin:0;background:#222}img{display:block;margin:auto;height:100vh;max-width:100vw;
object-fit:contain;image-rendering:pixelated}</style>
<img src="/video" alt="what the drone's camera sees">
</html>
"""


@dataclass(slots=True)
class _VideoImage:
    """An image, and its JPEG after it was first requested."""

    image: Image
    time_us: int
    jpeg: bytes | None = None

    def compressed(self) -> bytes:
        """The JPEG, made at the first call."""
        if self.jpeg is None:
            self.jpeg = encode_jpeg(self.image)
        return self.jpeg


def encode_jpeg(image: Image, quality: int = JPEG_QUALITY) -> bytes:
    """Compress a BGR image; thin coloured bars keep their colour by full chroma resolution and quality 98."""
    import cv2  # late: telemetry must not wait for it

    chroma = (cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444)
    settings = [cv2.IMWRITE_JPEG_QUALITY, quality, *chroma]
    done, data = cv2.imencode(".jpg", image, settings)
    if not done:
        raise VideoError(f"an image of shape {image.shape} cannot be compressed")
    return bytes(data)


def _is_own_fault(record: logging.LogRecord) -> bool:
    """Whether a message of the HTTP library is not only about what somebody has sent that is no HTTP."""
    from aiohttp.http_exceptions import HttpProcessingError

    return record.exc_info is None or not isinstance(record.exc_info[1], HttpProcessingError)


class VideoServer:
    """Serves the images published to it, and JSON documents beside them."""

    def __init__(self, host: str = "127.0.0.1", port: int = 8100, *, options: str = "--port") -> None:
        """Set the address; nothing is opened yet.

        Args:
            host: address to listen on.
            port: TCP port; 0 lets the system choose one.
            options: of the command, that choose another port; for the message when this one is in use.
        """
        self._options = options
        self._host = host
        self._port = port
        self._newest: _VideoImage | None = None
        self._documents: dict[str, JsonProvider] = {}
        self._texts = {"/": ("text/html", _PAGE)}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._runner: web.AppRunner | None = None
        self._arrived = asyncio.Event()
        self._closing = False

    @property
    def port(self) -> int:
        """The TCP port; after `start`, the one that is open."""
        return self._port

    @property
    def url(self) -> str:
        """Address of the page."""
        return f"http://{in_url(self._host, self._port)}/"

    def add_json(self, path: str, provider: JsonProvider) -> None:
        """Serve a JSON document at a path that begins with "/".

        The provider is called at each request with the query's parameters and returns what `json.dumps`
        takes; numbers that are not finite become null.
        """
        self._documents[path] = provider

    def add_text(self, path: str, content_type: str, text: str) -> None:
        """Serve a constant text at a path that begins with "/"."""
        self._texts[path] = (content_type, text)

    async def start(self) -> None:
        """Listen. The HTTP library is only imported here, in a thread: it takes a third of a second.

        Raises:
            VideoError: the port is in use or the address is not this machine's.
        """
        web = await asyncio.to_thread(import_module, "aiohttp.web")
        logging.getLogger("aiohttp.server").addFilter(_is_own_fault)
        app = web.Application()
        app.router.add_get(VIDEO_PATH, self._video, allow_head=False)
        app.router.add_get("/image.jpg", self._image)
        app.router.add_get("/{path:.*}", self._document)
        runner = web.AppRunner(app, access_log=None, shutdown_timeout=_CLOSE_S)
        await runner.setup()
        try:
            await web.TCPSite(runner, self._host, self._port).start()
        except (OSError, OverflowError) as error:
            await runner.cleanup()
            reason = (getattr(error, "strerror", None) or str(error)).split("\n", maxsplit=1)[0]
            raise VideoError(
                f"video: cannot listen on {self._host} port {self._port}: "
                f"{reason.rpartition(': ')[2].lower()}; choose another with {self._options}"
            ) from error
        self._port = runner.addresses[0][1]
        self._loop, self._runner = asyncio.get_running_loop(), runner

    def publish(self, image: Image, time_us: int) -> None:
        """Send an image to all clients. Never blocks; may be called from any thread.

        Args:
            image: BGR, shape (height, width, 3), uint8; must not be changed afterwards.
            time_us: vehicle time of its exposure, microseconds.
        """
        self._newest = _VideoImage(image, time_us)
        if self._loop is not None and not self._closing:
            self._loop.call_soon_threadsafe(self._wake)

    async def close(self) -> None:
        """End all streams and stop listening."""
        self._closing = True
        self._wake()
        if self._runner is not None:
            await self._runner.cleanup()
            self._runner = None

    def _wake(self) -> None:
        self._arrived.set()
        self._arrived.clear()

    async def _next(self, last: _VideoImage | None) -> _VideoImage | None:
        """Wait for another image than the last; None when the server closes."""
        while not self._closing:
            if self._newest is not None and self._newest is not last:
                return self._newest
            await self._arrived.wait()
        return None

    async def _video(self, request: web.Request) -> web.StreamResponse:
        from aiohttp import web

        response = web.StreamResponse(headers=STREAM_HEADERS)
        if request.transport is not None:
            request.transport.get_extra_info("socket").setsockopt(SOL_SOCKET, SO_SNDBUF, _SEND_BUFFER_BYTES)
            # Zero: a write waits until the kernel has taken all before it.
            request.transport.set_write_buffer_limits(high=0)
        try:
            await response.prepare(request)
            await response.write(STREAM_START)
            image = await self._next(None)
            while image is not None:
                await response.write(write_part(image.compressed(), image.time_us))
                image = await self._next(image)
        except ConnectionError:
            pass  # the client has disconnected
        return response

    async def _image(self, request: web.Request) -> web.Response:
        from aiohttp import web

        if self._newest is None:
            return web.Response(status=503, text="no image yet\n", headers={"Retry-After": "1"})
        headers = {"X-Time-Us": str(self._newest.time_us), "Cache-Control": "no-store"}
        return web.Response(body=self._newest.compressed(), content_type="image/jpeg", headers=headers)

    async def _document(self, request: web.Request) -> web.Response:
        from aiohttp import web

        if request.path in self._texts:
            content_type, text = self._texts[request.path]
            return web.Response(text=text, content_type=content_type)
        provider = self._documents.get(request.path)
        if provider is None:
            known = ", ".join([VIDEO_PATH, "/image.jpg", *self._texts, *self._documents])
            return web.Response(status=404, text=f"not here; there are {known}\n")
        try:
            text = json.dumps(finite(provider(request.query)), allow_nan=False)
        except Exception as error:  # a fault in a document must not harm the video
            return web.Response(status=500, text=f"{request.path}: {type(error).__name__}: {error!s:.200}\n")
        headers = {"Cache-Control": "no-store"}
        return web.Response(text=text, content_type="application/json", headers=headers)


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
        for module in ("cv2", "sitl.camera", "aiohttp.web"):
            await asyncio.to_thread(import_module, module)
        scenario = self._simulation.scenario
        video = VideoServer(
            self._settings.bind, self._settings.http_port, options="--instance (sim also: --video-port)"
        )
        video.add_json(REFEREE_PATH, self._referee_answer)
        task = Task.of(scenario, show_layout=self._settings.show_layout)
        video.add_json(SCENARIO_PATH, lambda _query: task.model_dump(mode="json"))
        if self._settings.video_rtp is not None:
            await asyncio.to_thread(import_module, "sitl.streaming.h264")
            from sitl.streaming.h264 import RtpSender

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
            position_arena_m=simulation.truth.position_arena_m,
            snapshot=referee.snapshot(),
            report=referee.report(query.get("state", ""), query.get("ended")),
            faults=simulation.fault_facts(),
            flown_path=referee.flown_path if "state" in query else (),
        )
        return standing.model_dump(mode="json")


def standing_place(truth: TrueState) -> StandingPlace | None:
    """Where a drone stands; None if it flies, or lies on its side."""
    if truth.motors_on or rotation(truth.attitude_arena)[8] < _UPRIGHT:
        return None
    return StandingPlace(position_arena_m=truth.position_arena_m, yaw_rad=yaw_of(truth.attitude_arena))
