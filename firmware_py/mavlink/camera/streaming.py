"""A camera's video streams: their messages, and which of them are sent.

A stream in RTP is sent unrequested, so it can be stopped. Of a stream over HTTP each viewer has its own,
which it begins and ends itself: no command takes the video from the others, such as an app in flight.
"""

from __future__ import annotations

from collections.abc import Callable
from math import isnan

from firmware_py.mavlink.camera import messages
from firmware_py.mavlink.camera.model import VideoEncoding, VideoStream
from firmware_py.missions.flight import SevenParams
from firmware_py.status import CommandResult
from framerunner.wire.dialect import Message, mavlink


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

    def messages(self, message_id: int, index: int) -> list[Message]:
        """Information or status of a stream, or of all, 0."""
        streams = self._streams
        requested = [(n, stream) for n, stream in enumerate(streams, start=1) if index in (0, n)]
        information = [
            messages.stream_information(stream, n, len(streams), running=self._is_running(stream))
            for n, stream in requested
        ]
        if message_id == mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION:
            return information
        if message_id != mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_STATUS:
            return []
        status = [messages.stream_status(each, n, running=self._is_running(each)) for n, each in requested]
        # MAVSDK 4.1 requests only the status, yet shows the last information that it receives: so that is
        # sent too, the preferred stream's last.
        return [*reversed(information), *status]

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
