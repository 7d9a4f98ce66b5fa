"""The mounting of a camera from a live drone and its camera, which an operator flies or holds in the hand.

Nothing is commanded: telemetry and images are watched, and it is said what movement is missing.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from contextlib import closing
from math import inf
from typing import TYPE_CHECKING

from framerunner.camera_calibration.mounting_report import MountingSearch, search_mounting
from framerunner.geometry.axes import flip_quaternion, flip_vector
from framerunner.geometry.vectors import Vec3
from framerunner.preflight.link import open_link
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.session.client import VehicleClient
from framerunner.wire.session.record import Record
from framerunner.wire.session.session import pose_rates
from offboard.drone import DroneError
from offboard.link.telemetry import least_lag
from vision.calibration.sightings import MotionReport
from vision.detectors import new_detector
from vision.sources import open_source
from vision.types import CameraFrame, Detections

if TYPE_CHECKING:
    from vision.calibration.model import Calibration

_FIND_S = 10.0
_REPORT_S = 5.0
_MIN_S = 20.0
"""Time that is watched at least, so that errors that go on for seconds are averaged."""
_WANTED_HZ = 50.0
_ENOUGH = 0.8  # share of these, of attitudes and positions
_MEASURED_S = 1.0
_MAX_REQUESTS = 5
_ATTITUDES = (mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, mavlink.MAVLINK_MSG_ID_ATTITUDE)


class Watched(Record):
    """The session with a drone, and images of its camera.

    Args:
        calibration: of its camera.
        task: of the simulator that renders the images; None: they are a real camera's.

    Attributes:
        reports: the drone's states, axes north, west, up.
        images: what was seen.
        stamped: whether the images have times of their own.
        ended: the drone is watched no longer; a thread uses the link until then.
    """

    def __init__(self, calibration: Calibration) -> None:
        super().__init__(heartbeat="companion")
        self.rates = pose_rates(_WANTED_HZ, _ENOUGH, _MEASURED_S, time.monotonic(), _MAX_REQUESTS)
        self.ended = False
        self.reports: list[MotionReport] = []
        self.images: list[Detections] = []
        self.stamped = False
        self._detect = new_detector("frames", calibration=calibration)
        self._lag_s: float | None = None

    def take(self, message: Message, now_s: float) -> bool:
        """Take a message that was received at a monotonic wall time; see `Session.take`."""
        is_newest, telemetry = super().take(message, now_s), self.telemetry
        attitude, position = telemetry.attitude, telemetry.position
        if is_newest and message.get_msgId() in _ATTITUDES and attitude is not None:
            self._lag_s = least_lag(self._lag_s, now_s - attitude.time_us * 1e-6)
        if is_newest and attitude is not None and position is not None:
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
        return is_newest

    def take_frame(self, frame: CameraFrame) -> None:
        """Take an image; one without a time stamp has the vehicle time of its arrival."""
        time_us = frame.time_us
        self.stamped = time_us is not None
        if time_us is None and self._lag_s is not None:
            time_us = round((frame.received_s - self._lag_s) * 1e6)
        if time_us is not None:
            self.images.append(self._detect(frame.image, time_us))


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
    watched = Watched(calibration)
    with closing(open_link(drone_url)) as link:
        client = VehicleClient(link, watched, time.monotonic)
        reader = asyncio.create_task(asyncio.to_thread(client.run, inf, "", lambda: watched.ended))
        viewer = asyncio.create_task(_watch_camera(camera_url, watched))
        tasks = [reader, viewer]
        try:
            async with asyncio.timeout(_FIND_S):
                await _until_heard(watched, tasks)
            return await _until_known(watched, tasks, calibration, position_flu_m, limit_s=limit_s, say=say)
        except TimeoutError:
            raise DroneError(_silent(watched, drone_url)) from None
        finally:
            watched.ended = True
            viewer.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)


def _silent(watched: Watched, drone_url: str) -> str:
    if watched.system_id is None:
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
