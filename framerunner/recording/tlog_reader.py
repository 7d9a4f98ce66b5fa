"""A real-time flight without a recording, from what every one leaves: its MAVLink log and its video."""

from __future__ import annotations

import heapq
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2

from framerunner.flying.plan import FlightPlan
from framerunner.recording.errors import RecordingError
from framerunner.recording.events import Event, Picture, time_of_event
from offboard.app import Moment
from offboard.drone import DroneState, VelocityCommand
from offboard.link.alignment import Alignment, Pose
from scenarios.models import Scenario
from scenarios.result import FlightResult
from vision.jpeg import MAX_PIXELS
from vision.types import Detections

TICK_US = 50_000
_TICKS_AT_MOST = 576_000  # eight hours: a log that holds more is damaged
_ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED
_NO_AUTOPILOT = 8  # MAV_AUTOPILOT_INVALID: a ground station, a camera, this app's own companion


class TlogRecording:
    """Telemetry and images of a run folder; the mission's states and what it detected are not in them.

    The video has no times: its last image is taken to be as old as the last telemetry, the others follow at
    the camera's rate.

    Args:
        folder: of the flight.
        scenario: what was flown; None if that is not known: places then count from where the drone started.
        result: what the flight came to, if it did.

    Raises:
        RecordingError: the log holds no telemetry.
    """

    def __init__(self, folder: Path, scenario: Scenario | None, result: FlightResult | None) -> None:
        self.title = folder.name
        self.result = result
        self._video = folder / "video.avi"
        self._rate_hz = 10.0 if scenario is None else scenario.camera.rate_hz
        self._moments = _read_moments(folder / "flight.tlog", _start(scenario))
        if not self._moments:
            raise RecordingError(f"replay '{folder}': flight.tlog holds no position; nothing can be shown")

    def events(self) -> Iterator[Event]:
        """Telemetry and images, in order of vehicle time."""
        return heapq.merge(self._moments, self._pictures(), key=time_of_event)

    def _pictures(self) -> Iterator[Picture]:
        if not self._video.exists():
            return
        video = cv2.VideoCapture(str(self._video))
        try:
            pixels = video.get(cv2.CAP_PROP_FRAME_WIDTH) * video.get(cv2.CAP_PROP_FRAME_HEIGHT)
            if pixels > MAX_PIXELS:
                raise RecordingError(
                    f"replay: '{self._video}' has images of {pixels:.0f} pixels; it is damaged"
                )
            count = int(video.get(cv2.CAP_PROP_FRAME_COUNT))
            last_us = self._moments[-1].state.time_us
            for number in range(count):
                read, image = video.read()
                if not read:
                    return
                age_s = (count - 1 - number) / self._rate_hz
                yield Picture(max(0, last_us - round(age_s * 1e6)), image)
        finally:
            video.release()


def _start(scenario: Scenario | None) -> Pose:
    if scenario is None:
        return Pose((0.0, 0.0, 0.0), 0.0)
    start = FlightPlan(scenario).start_pose
    return Pose(start[:3], start[3])


def _read_moments(path: Path, start: Pose) -> list[Moment]:
    """Put the log's messages together to ticks, 20 a second as the mission's.

    Raises:
        RecordingError: the log cannot be read.
    """
    os.environ.setdefault("MAVLINK20", "1")
    from pymavlink import mavutil

    try:
        log = mavutil.mavlink_connection(str(path), notimestamps=False)
    except Exception as error:  # the library raises whatever comes
        raise RecordingError(f"replay: '{path}' cannot be read: {error}") from None
    vehicle = _Vehicle(start, mavutil.interpret_px4_mode)
    moments: list[Moment] = []
    try:
        while True:
            message = log.recv_match(type=["HEARTBEAT", "ATTITUDE", "LOCAL_POSITION_NED"])
            if message is None:
                return moments
            moment = vehicle.take(message)
            if moment is not None:
                moments.append(moment)
                if len(moments) > _TICKS_AT_MOST:
                    raise RecordingError(f"replay: '{path}' is longer than eight hours; it must be damaged")
    finally:
        log.close()


class _Vehicle:
    """What the log has told of the vehicle so far."""

    def __init__(self, start: Pose, mode_name: Any) -> None:  # noqa: ANN401 - an untyped library's function
        self._start = start
        self._mode_name = mode_name
        self._alignment: Alignment | None = None
        self._yaw_rad: float | None = None
        self._mode = ""
        self._armed = False
        self._armed_us = 0
        self._next_us = 0

    def take(self, message: Any) -> Moment | None:  # noqa: ANN401 - as above
        """Take a message; a position after a yaw makes a moment, if one is due."""
        kind = message.get_type()
        if kind == "HEARTBEAT":
            if message.autopilot != _NO_AUTOPILOT:
                armed = bool(message.base_mode & _ARMED)
                if armed and not self._armed:
                    self._armed_us = self._next_us
                self._armed = armed
                self._mode = self._mode_name(message.base_mode, message.custom_mode)
            return None
        if kind == "ATTITUDE":
            self._yaw_rad = message.yaw
            return None
        time_us = message.time_boot_ms * 1000
        if self._yaw_rad is None or time_us < self._next_us:
            return None
        self._next_us = (time_us // TICK_US + 1) * TICK_US
        return self._moment(message, self._yaw_rad, time_us)

    def _moment(self, position: Any, yaw_rad: float, time_us: int) -> Moment:  # noqa: ANN401
        ned = Pose((position.x, position.y, position.z), yaw_rad)
        if self._alignment is None:
            self._alignment = Alignment(self._start, ned)
        pose = self._alignment.pose(ned)
        state = DroneState(
            time_us,
            *pose.position_m,
            pose.yaw_rad,
            self._alignment.vector((position.vx, position.vy, position.vz)),
            self._armed,
            self._mode == "OFFBOARD",
            self._mode,
        )
        flight_time_s = max(0.0, (time_us - self._armed_us) / 1e6) if self._armed_us else 0.0
        return Moment(state, VelocityCommand(), Detections(), self._mode.lower(), flight_time_s)
