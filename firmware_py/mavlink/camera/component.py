"""The camera, a component beside the autopilot (https://mavlink.io/en/services/camera.html).

It takes pictures, records video and sends the addresses of its streams. It refuses to zoom, focus or track.

A stream in RTP is sent unrequested, so it can be stopped. Of a stream over HTTP each viewer has its own,
which it begins and ends itself: no command takes the video from the others, such as an app in flight.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from math import isfinite, isnan

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.camera import camera_messages
from firmware_py.mavlink.camera.captures import MAX_COUNT, Captures, Recordings
from firmware_py.mavlink.camera.model import (
    CAMERA_COMPONENT_ID,
    CaptureSink,
    FixedCamera,
    PictureSpace,
    VideoEncoding,
    VideoStream,
)
from firmware_py.mavlink.service import DeviceComponent, MissionCommandHandler, VehicleCommand
from firmware_py.missions.flight import SevenParams
from firmware_py.status import CommandResult
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link


class Streaming:
    """The streams of a camera, numbered from 1, the preferred one first.

    Args:
        streams: of the camera.
        switch: called with whether streams in RTP are to be sent.
    """

    def __init__(self, streams: tuple[VideoStream, ...], switch: Callable[[bool], None] | None) -> None:
        self._streams = streams
        self._switch = switch
        self._sends = True

    def __bool__(self) -> bool:
        return bool(self._streams)

    def start(self, params: SevenParams) -> CommandResult:
        """VIDEO_START_STREAMING: param 1 is the stream, 0: all."""
        return self._turn(params[0], on=True)

    def stop(self, params: SevenParams) -> CommandResult:
        """VIDEO_STOP_STREAMING: param 1 is the stream, 0: all that can be stopped; over HTTP: DENIED."""
        return self._turn(params[0], on=False)

    def information(self, _link: Link, index: int) -> list[Message]:
        """VIDEO_STREAM_INFORMATION of a stream, or of all, 0."""
        return [
            camera_messages.stream_information(
                stream, n, len(self._streams), running=self._is_running(stream)
            )
            for n, stream in self._chosen(index)
        ]

    def status(self, link: Link, index: int) -> list[Message]:
        """VIDEO_STREAM_STATUS of a stream, or of all, 0.

        MAVSDK 4.1 requests only the status, yet shows the last information that it receives: so that is sent
        too, the preferred stream's last.
        """
        status = [
            camera_messages.stream_status(stream, n, running=self._is_running(stream))
            for n, stream in self._chosen(index)
        ]
        return [*reversed(self.information(link, index)), *status]

    def _chosen(self, index: int) -> list[tuple[int, VideoStream]]:
        return [(n, stream) for n, stream in enumerate(self._streams, start=1) if index in (0, n)]

    def _turn(self, number: float, *, on: bool) -> CommandResult:
        streams = self._streams
        if not streams or not (isnan(number) or 0 <= number <= len(streams)):
            return CommandResult.DENIED
        one = None if isnan(number) or number < 1 else streams[int(number) - 1]
        if one is not None and one.encoding is VideoEncoding.MJPEG_HTTP:
            return CommandResult.ACCEPTED if on else CommandResult.DENIED
        if self._switch is not None and on is not self._sends:
            self._sends = on
            self._switch(on)
        return CommandResult.ACCEPTED

    def _is_running(self, stream: VideoStream) -> bool:
        return self._sends or stream.encoding is VideoEncoding.MJPEG_HTTP


class CameraComponent(DeviceComponent):
    """Answers for the camera, sends its heartbeat and takes its pictures.

    Without a sink pictures are only counted, and nothing is recorded.
    """

    component_id = CAMERA_COMPONENT_ID
    kind = mavlink.MAV_TYPE_CAMERA

    def __init__(
        self,
        autopilot: Autopilot,
        exchange: Exchange,
        camera: FixedCamera,
        streaming: Streaming,
        sink: CaptureSink | None = None,
    ) -> None:
        super().__init__(autopilot, exchange)
        self._camera = camera
        self._streaming = streaming
        self._sink = sink
        self._mode = int(mavlink.CAMERA_MODE_IMAGE)
        self._recordings = recordings = Recordings(exchange, sink, self._report_capture)
        self._captures = Captures(autopilot, exchange, camera, sink)
        self._last_single: tuple[int, int, float] | None = None
        self.mission_commands: Mapping[int, MissionCommandHandler] = {
            mavlink.MAV_CMD_DO_DIGICAM_CONTROL: self._digicam,
            mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST: self._trigger_distance,
            mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL: self._trigger_interval,
            mavlink.MAV_CMD_RESET_CAMERA_SETTINGS: self._reset,
            mavlink.MAV_CMD_SET_CAMERA_MODE: self._set_mode,
            mavlink.MAV_CMD_IMAGE_START_CAPTURE: self._start_images,
            mavlink.MAV_CMD_IMAGE_STOP_CAPTURE: self._stop_images,
            mavlink.MAV_CMD_VIDEO_START_CAPTURE: recordings.start,
            mavlink.MAV_CMD_VIDEO_STOP_CAPTURE: recordings.stop,
            mavlink.MAV_CMD_VIDEO_START_STREAMING: streaming.start,
            mavlink.MAV_CMD_VIDEO_STOP_STREAMING: streaming.stop,
            mavlink.MAV_CMD_STORAGE_FORMAT: self._format,
            mavlink.MAV_CMD_SET_CAMERA_ZOOM: _unsupported,
            mavlink.MAV_CMD_SET_CAMERA_FOCUS: _unsupported,
        }
        self.commands = {
            **{number: partial(_run, work) for number, work in self.mission_commands.items()},
            mavlink.MAV_CMD_IMAGE_START_CAPTURE: self._start_once,
        }
        self.older_requests = {
            mavlink.MAV_CMD_REQUEST_CAMERA_INFORMATION: (mavlink.MAVLINK_MSG_ID_CAMERA_INFORMATION, 0),
            mavlink.MAV_CMD_REQUEST_CAMERA_SETTINGS: (mavlink.MAVLINK_MSG_ID_CAMERA_SETTINGS, 0),
            mavlink.MAV_CMD_REQUEST_STORAGE_INFORMATION: (mavlink.MAVLINK_MSG_ID_STORAGE_INFORMATION, 1),
            mavlink.MAV_CMD_REQUEST_CAMERA_CAPTURE_STATUS: (mavlink.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS, 0),
            mavlink.MAV_CMD_REQUEST_CAMERA_IMAGE_CAPTURE: (mavlink.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED, 1),
            mavlink.MAV_CMD_REQUEST_VIDEO_STREAM_INFORMATION: (
                mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION,
                1,
            ),
            mavlink.MAV_CMD_REQUEST_VIDEO_STREAM_STATUS: (mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_STATUS, 1),
        }
        self.replies = {
            mavlink.MAVLINK_MSG_ID_CAMERA_INFORMATION: lambda _, __: [self._information()],
            mavlink.MAVLINK_MSG_ID_CAMERA_SETTINGS: lambda _, __: [self._settings()],
            mavlink.MAVLINK_MSG_ID_STORAGE_INFORMATION: self._storage_information,
            mavlink.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS: lambda _, __: [self._capture_status()],
            mavlink.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED: self._image_captured,
            mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION: streaming.information,
            mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_STATUS: streaming.status,
        }

    def update(self) -> None:
        """Send the heartbeat and take pictures that are due."""
        super().update()
        self._captures.update()
        self._recordings.update()

    def _start_once(self, command: VehicleCommand) -> CommandResult:
        """IMAGE_START_CAPTURE; a repeated command for one picture, by its number, takes no other."""
        _, _, count, number = command.params
        if command.repeated and count == 1.0 and self._last_single == (*command.sender, number):
            return CommandResult.ACCEPTED
        result = self._start_images(command.all_params)
        if result is CommandResult.ACCEPTED:
            self._last_single = (*command.sender, number)
        return result

    def _information(self) -> Message:
        return camera_messages.information(
            self._camera,
            streams=bool(self._streaming),
            records=self._recordings.can_record,
            time_us=self._exchange.time_us,
        )

    def _storage_information(self, _link: Link, index: int) -> list[Message]:
        return (
            [camera_messages.storage_information(self._space(), self._exchange.time_us)] if index <= 1 else []
        )

    def _image_captured(self, _link: Link, index: int) -> list[Message]:
        message = self._captures.sent(index)
        return [] if message is None else [message]

    def _settings(self) -> Message:
        return camera_messages.settings(self._mode, self._exchange.time_us)

    def _space(self) -> PictureSpace | None:
        return None if self._sink is None else self._sink.space()

    def _capture_status(self) -> Message:
        captures, recorded_us = self._captures, self._recordings.recorded_us
        return camera_messages.capture_status(
            captures.interval_s, captures.count, recorded_us, self._space(), self._exchange.time_us
        )

    def _report_capture(self) -> None:
        self._exchange.broadcast(self._capture_status(), CAMERA_COMPONENT_ID)

    def _start_images(self, params: SevenParams) -> CommandResult:
        interval_s = 0.0 if isnan(params[1]) else params[1]
        return self._captures.start(interval_s, 1 if isnan(params[2]) else _whole_count(params[2]))

    def _stop_images(self, _params: SevenParams) -> CommandResult:
        self._captures.stop()
        return CommandResult.ACCEPTED

    def _digicam(self, params: SevenParams) -> CommandResult:
        return self._captures.start(0.0, 1) if params[4] == 1.0 else CommandResult.UNSUPPORTED

    def _trigger_distance(self, params: SevenParams) -> CommandResult:
        result = self._captures.every(max(0.0, params[0]))
        if result is CommandResult.ACCEPTED and params[2] == 1.0 and params[0] <= 0.0:
            return self._captures.start(0.0, 1)
        return result

    def _trigger_interval(self, params: SevenParams) -> CommandResult:
        if params[0] <= 0.0:
            return self._stop_images(params)
        return self._captures.start(params[0] / 1e3, 0)

    def _set_mode(self, params: SevenParams) -> CommandResult:
        """SET_CAMERA_MODE: images or, if it records, video; it does both in each."""
        video = self._recordings.can_record and params[1] == mavlink.CAMERA_MODE_VIDEO
        if not video and params[1] != mavlink.CAMERA_MODE_IMAGE:
            return CommandResult.DENIED
        self._mode = int(params[1])
        self._exchange.broadcast(self._settings(), CAMERA_COMPONENT_ID)
        return CommandResult.ACCEPTED

    def _reset(self, params: SevenParams) -> CommandResult:
        """RESET_CAMERA_SETTINGS: no series of pictures, and the mode for images."""
        self._mode = int(mavlink.CAMERA_MODE_IMAGE)
        return self._stop_images(params)

    def _format(self, params: SevenParams) -> CommandResult:
        """STORAGE_FORMAT: param 1 is the storage, 1 or, as MAVSDK's examples have it, 0; param 2 must be 1.

        Pictures and recordings are deleted; no other file is. A recording ends.
        """
        if self._sink is None:
            return CommandResult.UNSUPPORTED
        if params[0] not in (0.0, 1.0) or params[1] != 1.0:
            return CommandResult.DENIED
        self._recordings.stop(params)
        if not self._sink.format():
            return CommandResult.FAILED
        self._captures.forget()
        self._report_capture()
        return CommandResult.ACCEPTED


def _run(work: MissionCommandHandler, command: VehicleCommand) -> CommandResult:
    return work(command.all_params)


def _unsupported(_params: SevenParams) -> CommandResult:
    return CommandResult.UNSUPPORTED


def _whole_count(number: float) -> int:
    """A count of a command; -1 if it is invalid."""
    return int(number) if isfinite(number) and 0.0 <= number <= MAX_COUNT else -1
