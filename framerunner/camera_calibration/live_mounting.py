"""The mounting of a camera from a live drone and its camera, which an operator flies or holds in the hand.

Nothing is commanded: telemetry and images are watched, and it is said what movement is missing.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from contextlib import closing
from typing import TYPE_CHECKING

from framerunner.camera_calibration.mounting_report import MountingSearch, search_mounting
from framerunner.geometry.axes import flip_quaternion, flip_vector
from framerunner.geometry.vectors import Vec3
from framerunner.preflight.session import open_link
from framerunner.wire.dialect import (
    AUTOPILOT_COMPONENT_ID,
    Message,
    companion_heartbeat,
    is_vehicle,
    mavlink,
    request_rate,
)
from framerunner.wire.simulator_api import SimulatorApi
from framerunner.wire.vehicle_telemetry import VehicleTelemetry
from offboard.drone import DroneError
from offboard.link.telemetry import least_lag
from vision.calibration.sightings import MotionReport
from vision.detectors import new_detector
from vision.sources import open_source
from vision.types import CameraFrame, Detections

if TYPE_CHECKING:
    from framerunner.wire.transports.vehicle_link import VehicleLink
    from scenarios.task import Task
    from vision.calibration.model import Calibration

_RECEIVE_S = 0.05
_BEAT_S = 1.0
_FIND_S = 10.0
_REPORT_S = 5.0
_MIN_S = 20.0
"""Time that is watched at least, so that errors that go on for seconds are averaged."""
_WANTED_HZ = 50.0
_ENOUGH_REPORTS = 80  # a second: attitudes and positions, 40 each
_MAX_REQUESTS = 5
_ATTITUDES = (mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, mavlink.MAVLINK_MSG_ID_ATTITUDE)


class Watched:
    """Telemetry and images of a drone.

    Args:
        calibration: of its camera.
        task: of the simulator that renders the images; None: they are a real camera's.

    Attributes:
        reports: the drone's states, axes north, west, up.
        images: what was seen.
        stamped: whether the images have times of their own.
        vehicle: MAVLink id; None until it is heard.
    """

    def __init__(self, calibration: Calibration, task: Task | None) -> None:
        self.reports: list[MotionReport] = []
        self.images: list[Detections] = []
        self.stamped = False
        self.vehicle: int | None = None
        smooth = task is not None and task.camera.effects is not None
        self._detect = new_detector(
            "frames", calibration=calibration, rendered=task is not None, smooth=smooth
        )
        self._telemetry = VehicleTelemetry()
        self._lag_s: float | None = None

    def take_messages(self, messages: list[Message], now_s: float) -> None:
        """Take what was received at a monotonic wall time."""
        telemetry = self._telemetry
        for message in messages:
            if self.vehicle is None and is_vehicle(message):
                self.vehicle = message.get_srcSystem()
            if (message.get_srcSystem(), message.get_srcComponent()) != (
                self.vehicle,
                AUTOPILOT_COMPONENT_ID,
            ):
                continue
            if not telemetry.take(message, now_s):
                continue
            attitude, position = telemetry.attitude, telemetry.position
            if message.get_msgId() in _ATTITUDES and attitude is not None:
                self._lag_s = least_lag(self._lag_s, now_s - attitude.time_us * 1e-6)
            if attitude is not None and position is not None:
                self.reports.append(
                    MotionReport(
                        attitude.time_us,
                        position.time_us,
                        flip_vector(position.position_ned_m),
                        flip_vector(position.velocity_ned_m_s),
                        flip_quaternion(attitude.attitude_ned),
                    )
                )
        if telemetry.restarts:
            raise DroneError("the vehicle has restarted; start the measurement again")

    def take_frame(self, frame: CameraFrame) -> None:
        """Take an image; one without a time stamp has the vehicle time of its arrival."""
        time_us = frame.time_us
        self.stamped = time_us is not None
        if time_us is None and self._lag_s is not None:
            time_us = round((frame.received_s - self._lag_s) * 1e6)
        if time_us is not None:
            self.images.append(self._detect(frame.image, time_us))


async def _rendered_task(camera_url: str) -> Task | None:
    """The task whose images a URL serves, if it is that of a simulator or a virtual camera."""
    import aiohttp
    from pydantic import ValidationError

    from scenarios.task import Task

    api = SimulatorApi.of_video(camera_url)
    if api is None or api.video_url != camera_url:
        return None
    limit = aiohttp.ClientTimeout(total=2.0)
    try:
        async with aiohttp.ClientSession() as session, session.get(api.scenario_url, timeout=limit) as answer:
            return Task.model_validate_json(await answer.read()) if answer.status == 200 else None
    except (aiohttp.ClientError, TimeoutError, ValidationError):
        return None


async def measure_live(
    drone_url: str,
    camera_url: str,
    calibration: Calibration,
    position_flu_m: Vec3,
    *,
    limit_s: float,
    say: Callable[[str], None],
) -> tuple[MountingSearch, bool]:
    """Watch a drone until its camera's mounting is known, or a time is over.

    Args:
        drone_url: where its telemetry is heard.
        camera_url: of its camera.
        calibration: of the camera.
        position_flu_m: of the camera from the drone's centre, as measured by hand.
        limit_s: for how long it is watched at most.
        say: called with lines for people.

    Returns:
        What was found, and whether the images have time stamps.

    Raises:
        CameraError: the camera cannot be opened or has failed.
        CalibrationError: its images have another size than the calibration's.
        LinkError: the link cannot be opened or has failed.
        DroneError: no vehicle is heard, or it has restarted.
    """
    watched = Watched(calibration, await _rendered_task(camera_url))
    with closing(open_link(drone_url)) as link:
        reading = _Reading(link, watched)
        reader = asyncio.create_task(reading.run())
        viewer = asyncio.create_task(_watch_camera(camera_url, watched))
        tasks = [reader, viewer]
        try:
            async with asyncio.timeout(_FIND_S):
                await _until_heard(watched, tasks)
            return await _until_known(watched, tasks, calibration, position_flu_m, limit_s=limit_s, say=say)
        except TimeoutError:
            raise DroneError(_silent(watched, drone_url)) from None
        finally:
            reading.stopped = True  # a thread uses the link until then
            viewer.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)


def _silent(watched: Watched, drone_url: str) -> str:
    if watched.vehicle is None:
        return (
            f"no vehicle was heard on {drone_url} within {_FIND_S:g} s; "
            "is it running and sending to this address?"
        )
    what = "no attitude and position" if not watched.reports else "no image"
    advice = "let the link carry ATTITUDE and LOCAL_POSITION_NED, and check the camera"
    return f"{what} within {_FIND_S:g} s; {advice}"


async def _watch_camera(url: str, watched: Watched) -> None:
    async with open_source(url) as camera:
        async for frame in camera.frames():
            watched.take_frame(frame)
    raise DroneError("the camera's stream ended")


async def _until_heard(watched: Watched, tasks: list[asyncio.Task[None]]) -> None:
    while not (watched.reports and watched.images):
        _raise_from(tasks)
        await asyncio.sleep(0.05)


async def _until_known(
    watched: Watched,
    tasks: list[asyncio.Task[None]],
    calibration: Calibration,
    position_flu_m: Vec3,
    *,
    limit_s: float,
    say: Callable[[str], None],
) -> tuple[MountingSearch, bool]:
    began_s = time.monotonic()
    say(
        "drone and camera are heard; nothing is commanded. Hover or carry the drone before frames: yaw "
        "slowly, and move nearer, farther and to the side by a metre (Ctrl-C stops)"
    )
    while True:
        next_s = time.monotonic() + _REPORT_S
        while time.monotonic() < next_s:
            _raise_from(tasks)
            await asyncio.sleep(0.1)
        images, reports = list(watched.images), list(watched.reports)
        search = await asyncio.to_thread(
            search_mounting, images, reports, calibration, position_flu_m, stamped=watched.stamped
        )
        over_s = time.monotonic() - began_s
        if (not search.missing and over_s >= _MIN_S) or over_s >= limit_s:
            return search, watched.stamped
        say(f"{over_s:.0f} s, {search.movement.sightings} sightings: {'; '.join(search.missing) or 'go on'}")


def _raise_from(tasks: list[asyncio.Task[None]]) -> None:
    """Raise the error of a task that has ended."""
    for task in tasks:
        if task.done() and not task.cancelled() and (error := task.exception()) is not None:
            raise error


class _Reading:
    """Reads a link, and asks the vehicle for what is needed."""

    def __init__(self, link: VehicleLink, watched: Watched) -> None:
        self.stopped = False
        self._link, self._watched = link, watched
        self._requests = 0
        self._reports = 0

    async def run(self) -> None:
        """Read until stopped; raises `LinkError` if the link fails."""
        beat_s = -_BEAT_S
        while not self.stopped:
            now_s = time.monotonic()
            if now_s - beat_s >= _BEAT_S:
                beat_s = now_s
                # Over udpout the vehicle cannot send before it has received something.
                self._link.send(companion_heartbeat())
                self._ask_for_rates()
            messages, now_s = await asyncio.to_thread(self._receive)
            self._watched.take_messages(messages, now_s)

    def _receive(self) -> tuple[list[Message], float]:
        messages = self._link.receive(_RECEIVE_S)
        return messages, time.monotonic()

    def _ask_for_rates(self) -> None:
        """Once a second: request poses more often if fewer came than are needed."""
        vehicle, reports = self._watched.vehicle, len(self._watched.reports)
        few, self._reports = reports - self._reports < _ENOUGH_REPORTS, reports
        if vehicle is None or not few or self._requests >= _MAX_REQUESTS:
            return
        self._requests += 1
        for number in (mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED):
            self._link.send(request_rate(vehicle, number, _WANTED_HZ))
