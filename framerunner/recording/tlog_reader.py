"""Reads a real-time flight that has no recording from its MAVLink log and its video."""

from __future__ import annotations

import heapq
import os
from collections.abc import Iterator, Sequence
from math import ceil
from pathlib import Path

import cv2

from framerunner.flying.plan import FlightPlan
from framerunner.geometry.axes import ArenaAlignment, Pose
from framerunner.recording.events import Crossed, Event, RecordedImage, RecordingError, time_of_event
from framerunner.runs.run_files import RunFiles
from framerunner.wire.dialect import Message, is_vehicle, mavlink
from framerunner.wire.px4_modes import OFFBOARD, px4_name
from framerunner.wire.vehicle_telemetry import AttitudeReport, PositionReport, VehicleTelemetry
from offboard.app import Moment
from offboard.drone import DroneState, VelocityFluCommand
from scenarios.models import Scenario
from scenarios.result import FlightResult
from vision.jpeg import MAX_PIXELS
from vision.types import Detections

TICK_US = 50_000
_READ = ["HEARTBEAT", "ATTITUDE", "LOCAL_POSITION_NED", "COMMAND_LONG"]
_ARM_US = 2_000_000  # in which a command to arm shows in a heartbeat, which comes once a second
MAX_TICKS = 576_000
"""Eight hours: what has more is damaged."""


class TlogRecording:
    """Telemetry and images of a run folder; they contain neither the mission's states nor its detections.

    The crossings are those of the result, counted from when the motors went on.

    The video has no times: its last image gets the time of the last telemetry, the others are spaced at the
    camera's rate.

    Args:
        files: of the flight.
        scenario: what was flown; if None, positions are relative to the start.
        result: None if the flight left none.

    Raises:
        RecordingError: the log holds no telemetry.
    """

    def __init__(self, files: RunFiles, scenario: Scenario | None, result: FlightResult | None) -> None:
        self.title = files.path.name
        self.result = result
        self._video = files.video
        self._rate_hz = 10.0 if scenario is None else scenario.camera.rate_hz
        self._moments = _read_moments(files.tlog, _start(scenario))
        if not self._moments:
            raise RecordingError(f"replay '{files.path}': its log holds no position; nothing can be shown")
        times_s = {} if result is None else result.times_s
        began_us = motors_on_us(self._moments)
        crossings = [Crossed(began_us + ceil(at_s * 1e6), colour) for colour, at_s in times_s.items()]
        self._crossings = sorted(crossings, key=time_of_event)

    def events(self) -> Iterator[Event]:
        """Telemetry, images and crossings, in order of vehicle time."""
        return heapq.merge(self._moments, self._images(), self._crossings, key=time_of_event)

    def _images(self) -> Iterator[RecordedImage]:
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
                yield RecordedImage(max(0, last_us - round(age_s * 1e6)), image)
        finally:
            video.release()


def motors_on_us(moments: Sequence[Moment]) -> int:
    """Vehicle time at which the motors went on, microseconds; of the first tick if they never were."""
    for moment in moments:
        if moment.flight_time_s > 0.0:
            return moment.state.time_us - round(moment.flight_time_s * 1e6)
    return moments[0].state.time_us


def _start(scenario: Scenario | None) -> Pose:
    if scenario is None:
        return Pose((0.0, 0.0, 0.0), 0.0)
    start = FlightPlan(scenario).start_pose
    return Pose(start[:3], start[3])


def _read_moments(path: Path, start: Pose) -> list[Moment]:
    """Build ticks from the log's messages, 20 a second like the mission's.

    Raises:
        RecordingError: the log cannot be read.
    """
    os.environ.setdefault("MAVLINK20", "1")
    from pymavlink import mavutil

    try:
        log = mavutil.mavlink_connection(str(path), notimestamps=False)
    except Exception as error:  # the library may raise any error
        raise RecordingError(f"replay: '{path}' cannot be read: {error}") from None
    ticks = _Ticks(start)
    moments: list[Moment] = []
    try:
        while True:
            message = log.recv_match(type=_READ)
            if message is None:
                return moments
            moment = ticks.take(message)
            if moment is not None:
                moments.append(moment)
                if len(moments) > MAX_TICKS:
                    raise RecordingError(f"replay: '{path}' is longer than eight hours; it must be damaged")
    finally:
        log.close()


class _Ticks:
    """Builds ticks from messages."""

    def __init__(self, start: Pose) -> None:
        self._start = start
        self._telemetry = VehicleTelemetry()
        self._alignment: ArenaAlignment | None = None
        self._arm_command_us = -_ARM_US
        self._armed_us = 0
        self._next_us = 0

    def take(self, message: Message) -> Moment | None:
        """Add a message; returns a tick with a position that follows an attitude, if one is due."""
        telemetry, kind = self._telemetry, message.get_msgId()
        if kind == mavlink.MAVLINK_MSG_ID_COMMAND_LONG:
            if message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM and message.param1 == 1.0:
                self._arm_command_us = self._next_us
            return None
        if kind == mavlink.MAVLINK_MSG_ID_HEARTBEAT and not is_vehicle(message):
            return None
        was_armed = telemetry.armed
        is_newest = telemetry.take(message)
        if telemetry.armed and not was_armed:
            was_commanded = self._next_us - self._arm_command_us < _ARM_US
            self._armed_us = self._arm_command_us if was_commanded else self._next_us
        position = telemetry.position
        if kind != mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED or not is_newest or position is None:
            return None
        attitude = telemetry.attitude
        if attitude is None or position.time_us < self._next_us:
            return None
        self._next_us = (position.time_us // TICK_US + 1) * TICK_US
        return self._moment(position, attitude)

    def _moment(self, position: PositionReport, attitude: AttitudeReport) -> Moment:
        telemetry = self._telemetry
        ned = Pose(position.position_ned_m, position.yaw_ned_rad)
        if self._alignment is None:
            self._alignment = ArenaAlignment(self._start, ned)
        pose = self._alignment.pose(ned)
        mode = px4_name(telemetry.custom_mode) if telemetry.is_px4 else telemetry.mode_name.upper()
        state = DroneState(
            position.time_us,
            *pose.position_m,
            pose.yaw_rad,
            self._alignment.vector(position.velocity_ned_m_s),
            telemetry.armed,
            telemetry.mode is OFFBOARD,
            mode,
            attitude_arena=self._alignment.attitude(attitude.attitude_ned),
        )
        flight_time_s = max(0.0, (position.time_us - self._armed_us) / 1e6) if self._armed_us else 0.0
        return Moment(state, VelocityFluCommand(), Detections(), mode.lower(), flight_time_s)
