"""The camera, a component beside the autopilot (https://mavlink.io/en/services/camera.html).

It takes pictures and sends the addresses of its video. It refuses to record, zoom, focus or track. Its video
always runs and cannot be stopped.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from functools import partial
from math import dist, inf, isfinite, isnan

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.camera import messages
from firmware_py.mavlink.camera.model import (
    CAMERA_COMPONENT_ID,
    CameraModel,
    CaptureSink,
    PictureSpace,
    VideoStream,
)
from firmware_py.mavlink.service import Command, Service
from firmware_py.missions.flight import SevenParams
from firmware_py.status import CommandResult
from geometry.vectors import Vec3
from wire.dialect import Message, mavlink
from wire.exchange import Exchange

_REMEMBERED = 1000  # pictures whose messages can be requested again
_MAX_INTERVAL_S = 86400.0
_MAX_COUNT = 1_000_000
_HEARTBEAT_US = 1_000_000

_REQUESTS: dict[int, tuple[int, int]] = {
    # Older than REQUEST_MESSAGE: the message, and which of their parameters is its index (0: none).
    mavlink.MAV_CMD_REQUEST_CAMERA_INFORMATION: (mavlink.MAVLINK_MSG_ID_CAMERA_INFORMATION, 0),
    mavlink.MAV_CMD_REQUEST_CAMERA_SETTINGS: (mavlink.MAVLINK_MSG_ID_CAMERA_SETTINGS, 0),
    mavlink.MAV_CMD_REQUEST_STORAGE_INFORMATION: (mavlink.MAVLINK_MSG_ID_STORAGE_INFORMATION, 1),
    mavlink.MAV_CMD_REQUEST_CAMERA_CAPTURE_STATUS: (mavlink.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS, 0),
    mavlink.MAV_CMD_REQUEST_CAMERA_IMAGE_CAPTURE: (mavlink.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED, 1),
    mavlink.MAV_CMD_REQUEST_VIDEO_STREAM_INFORMATION: (mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION, 1),
    mavlink.MAV_CMD_REQUEST_VIDEO_STREAM_STATUS: (mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_STATUS, 1),
}


class Captures:
    """Takes pictures when they are due and broadcasts a message for each.

    Attributes:
        count: pictures taken since boot.
        interval_s: of the present series; 0: none.
    """

    def __init__(
        self, autopilot: Autopilot, exchange: Exchange, camera: CameraModel, sink: CaptureSink | None
    ) -> None:
        self._autopilot = autopilot
        self._exchange = exchange
        self._min_interval_s = 1.0 / camera.rate_hz
        self._sink = sink
        self._sent: OrderedDict[int, Message] = OrderedDict()
        self._left = 0.0
        self._due_us = 0
        self._spacing_m = 0.0
        self._last_place_ned_m: Vec3 | None = None
        self.count = 0
        self.interval_s = 0.0

    def start(self, interval_s: float, count: int) -> CommandResult:
        """Take pictures from now on, instead of the present series.

        Args:
            interval_s: between them, in vehicle time; the camera's minimum replaces a smaller one.
            count: of pictures; 0: until stopped.

        Returns:
            ACCEPTED; FAILED if a single picture could not be taken; DENIED for an invalid interval or count.
        """
        if not (0.0 <= interval_s <= _MAX_INTERVAL_S and 0 <= count <= _MAX_COUNT):
            return CommandResult.DENIED
        if count == 1:
            return CommandResult.ACCEPTED if self._take() else CommandResult.FAILED
        self.interval_s = max(interval_s, self._min_interval_s)
        self._left = count or inf
        self._due_us = self._exchange.time_us
        return CommandResult.ACCEPTED

    def every(self, spacing_m: float) -> CommandResult:
        """Take a picture each time the vehicle has moved by a distance; 0: no more."""
        if not 0.0 <= spacing_m < inf:
            return CommandResult.DENIED
        self._spacing_m = spacing_m
        self._last_place_ned_m = None
        return CommandResult.ACCEPTED

    def stop(self) -> None:
        """End all series."""
        self.interval_s = 0.0
        self._spacing_m = 0.0

    def sent(self, index: int) -> Message | None:
        """The message of a picture; None if it is too old, or there is no such picture."""
        return self._sent.get(index)

    def update(self) -> None:
        """Take what is due."""
        if self.interval_s > 0.0 and self._exchange.time_us >= self._due_us:
            self._take()
            self._due_us = max(self._due_us + round(self.interval_s * 1e6), self._exchange.time_us)
            self._left -= 1
            if self._left <= 0:
                self.interval_s = 0.0
        if self._spacing_m > 0.0:
            self._take_by_distance()

    def _take_by_distance(self) -> None:
        place = self._autopilot.state.position_ned_m
        last = self._last_place_ned_m
        if last is None or dist(place, last) >= self._spacing_m:
            self._last_place_ned_m = place
            self._take()

    def _take(self) -> bool:
        exchange, index = self._exchange, self.count
        url = "" if self._sink is None else self._sink.capture(exchange.time_us, index)
        message = messages.image_captured(self._autopilot, exchange, index, url)
        if url is not None:
            self.count += 1
            self._sent[index] = message
            if len(self._sent) > _REMEMBERED:
                self._sent.popitem(last=False)
        exchange.broadcast(message, CAMERA_COMPONENT_ID)
        return url is not None


class CameraComponent(Service):
    """Answers for the camera, sends its heartbeat and takes its pictures.

    The first video stream is the preferred one; without a sink pictures are only counted.
    """

    component_id = CAMERA_COMPONENT_ID

    def __init__(
        self,
        autopilot: Autopilot,
        exchange: Exchange,
        camera: CameraModel,
        video: tuple[VideoStream, ...] = (),
        sink: CaptureSink | None = None,
    ) -> None:
        self._autopilot = autopilot
        self._exchange = exchange
        self._camera = camera
        self._video = video
        self._sink = sink
        self._captures = Captures(autopilot, exchange, camera, sink)
        self._heartbeat_due_us = 0
        self._last_single: tuple[int, int, float] | None = None
        self._work: dict[int, Callable[[SevenParams], CommandResult]] = {
            mavlink.MAV_CMD_DO_DIGICAM_CONTROL: self._digicam,
            mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST: self._trigger_distance,
            mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL: self._trigger_interval,
            mavlink.MAV_CMD_RESET_CAMERA_SETTINGS: self._stop_images,
            mavlink.MAV_CMD_SET_CAMERA_MODE: self._set_mode,
            mavlink.MAV_CMD_IMAGE_START_CAPTURE: self._start_images,
            mavlink.MAV_CMD_IMAGE_STOP_CAPTURE: self._stop_images,
            mavlink.MAV_CMD_VIDEO_START_CAPTURE: _unsupported,
            mavlink.MAV_CMD_VIDEO_STOP_CAPTURE: _unsupported,
            mavlink.MAV_CMD_VIDEO_START_STREAMING: self._start_streaming,
            mavlink.MAV_CMD_VIDEO_STOP_STREAMING: _unsupported,
            mavlink.MAV_CMD_STORAGE_FORMAT: _unsupported,
            mavlink.MAV_CMD_SET_CAMERA_ZOOM: _unsupported,
            mavlink.MAV_CMD_SET_CAMERA_FOCUS: _unsupported,
        }
        self.commands = {
            **{number: partial(_run, work) for number, work in self._work.items()},
            **{number: partial(self._answer, *request) for number, request in _REQUESTS.items()},
            mavlink.MAV_CMD_IMAGE_START_CAPTURE: self._start_once,
            mavlink.MAV_CMD_REQUEST_MESSAGE: self._request_message,
        }

    def update(self) -> None:
        """Send the heartbeat and take pictures that are due."""
        time_us = self._exchange.time_us
        if time_us >= self._heartbeat_due_us:
            self._heartbeat_due_us = time_us - time_us % _HEARTBEAT_US + _HEARTBEAT_US
            beat = messages.heartbeat(self._autopilot.status.mode)
            self._exchange.broadcast(beat, CAMERA_COMPONENT_ID)
        self._captures.update()

    def run(self, command: int, params: SevenParams) -> CommandResult:
        """Execute a MAV_CMD to the camera, such as a mission's; UNSUPPORTED if it is not the camera's."""
        work = self._work.get(command)
        return CommandResult.UNSUPPORTED if work is None else work(params)

    def takes_broadcast(self, command: int) -> bool:
        """Whether a command to all components is the camera's, and not the autopilot's."""
        return command in self.commands and command != mavlink.MAV_CMD_REQUEST_MESSAGE

    def _start_once(self, command: Command) -> CommandResult:
        """IMAGE_START_CAPTURE; a repeated command for one picture, by its number, takes no other."""
        _, _, count, number = command.params
        if command.repeated and count == 1.0 and self._last_single == (*command.sender, number):
            return CommandResult.ACCEPTED
        result = self._start_images(command.all_params)
        if result is CommandResult.ACCEPTED:
            self._last_single = (*command.sender, number)
        return result

    def _request_message(self, command: Command) -> CommandResult:
        message_id = command.params[0]
        return self._send(command, int(message_id) if isfinite(message_id) else -1, command.params[1])

    def _answer(self, message_id: int, index_param: int, command: Command) -> CommandResult:
        """Answer a request that is older than REQUEST_MESSAGE."""
        return self._send(command, message_id, command.all_params[index_param - 1] if index_param else 0.0)

    def _send(self, command: Command, message_id: int, argument: float) -> CommandResult:
        index = int(argument) if isfinite(argument) and 0 <= argument < 1 << 31 else 0
        answers = self._requested(message_id, index)
        for answer in answers:
            self._exchange.send(command.link, answer, CAMERA_COMPONENT_ID)
        return CommandResult.ACCEPTED if answers else CommandResult.DENIED

    def _requested(self, message_id: int, index: int) -> list[Message]:
        time_us, captures = self._exchange.time_us, self._captures
        match message_id:
            case mavlink.MAVLINK_MSG_ID_CAMERA_INFORMATION:
                streams = bool(self._video)
                message = messages.information(self._camera, streams=streams, time_us=time_us)
            case mavlink.MAVLINK_MSG_ID_CAMERA_SETTINGS:
                message = messages.settings(time_us)
            case mavlink.MAVLINK_MSG_ID_STORAGE_INFORMATION if index <= 1:
                message = messages.storage_information(self._space(), time_us)
            case mavlink.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS:
                space = self._space()
                message = messages.capture_status(captures.interval_s, captures.count, space, time_us)
            case mavlink.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED:
                message = captures.sent(index)
            case _:
                return self._of_streams(message_id, index)
        return [] if message is None else [message]

    def _space(self) -> PictureSpace | None:
        return None if self._sink is None else self._sink.space()

    def _of_streams(self, message_id: int, index: int) -> list[Message]:
        """The messages of a stream, numbered from 1, or of all, 0."""
        streams = self._video
        requested = [(n, stream) for n, stream in enumerate(streams, start=1) if index in (0, n)]
        information = [messages.stream_information(stream, n, len(streams)) for n, stream in requested]
        if message_id == mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION:
            return information
        if message_id != mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_STATUS:
            return []
        # MAVSDK 4.1 requests only the status, yet shows the last information that it receives: so that is
        # sent too, the preferred stream's last.
        return [*reversed(information), *(messages.stream_status(stream, n) for n, stream in requested)]

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
        image = params[1] == mavlink.CAMERA_MODE_IMAGE
        return CommandResult.ACCEPTED if image else CommandResult.DENIED

    def _start_streaming(self, params: SevenParams) -> CommandResult:
        """An existing stream runs already; stream 0 means all."""
        exists = isnan(params[0]) or 0 <= params[0] <= len(self._video)
        return CommandResult.ACCEPTED if exists and self._video else CommandResult.DENIED


def _run(work: Callable[[SevenParams], CommandResult], command: Command) -> CommandResult:
    return work(command.all_params)


def _unsupported(_params: SevenParams) -> CommandResult:
    return CommandResult.UNSUPPORTED


def _whole_count(number: float) -> int:
    """A count of a command; -1 if it is invalid."""
    return int(number) if isfinite(number) and 0.0 <= number <= _MAX_COUNT else -1
