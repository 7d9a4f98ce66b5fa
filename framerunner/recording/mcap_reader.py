"""Reads the recordings that `mcap_writer` writes."""

from __future__ import annotations

import json
import warnings
from base64 import b64decode
from collections.abc import Iterator
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any, BinaryIO, cast

import cv2
import numpy as np
from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.writer import MCAP0_MAGIC

from framerunner.geometry.gate_shape import GateShape
from framerunner.geometry.rotations import quaternion_from_yaw
from framerunner.geometry.vectors import Vec3
from framerunner.recording.events import Crossed, Event, RecordedImage, RecordingError, TruePlace
from framerunner.recording.mcap_file import (
    MAX_CHUNK_BYTES,
    BoundedFile,
    first_and_last_bytes,
    messages,
    summary_of,
)
from framerunner.recording.mcap_writer import METADATA
from framerunner.recording.schemas import (
    CROSSING,
    DETECTIONS,
    ESTIMATE,
    IMAGE,
    MAP,
    MISSION,
    PATH,
    SETPOINT,
    TELEMETRY,
    TRUTH,
)
from framerunner.runs.run_files import RESULT
from framerunner.wire.mission_report import Plain, TransitionTaken, plain_value
from offboard.app import Moment
from offboard.drone import DroneState, PlaceEstimate, VelocityFluCommand
from offboard.navigation.view import GateEstimate, NavigationView
from scenarios.result import FlightResult, ResultError
from vision.jpeg import JPEG_START, MAX_PIXELS, ImageError, jpeg_structure
from vision.types import Detection, Detections, Image

_MAX_TEXT_BYTES = 1_000_000  # of a message that is no image
_MAX_GATES = 100  # of a map, and points of a path, that are kept
_MAX_PATH = 1000
_MAX_IDS = 100  # of the transitions of one tick
_PNG_START = b"\x89PNG\r\n\x1a\n"
Json = dict[str, Any]


class McapRecording:
    """A recording of framerunner's; call `close` at the end.

    Args:
        path: an MCAP file.

    Attributes:
        title: scenario and mission.
        result: the attached result; None if the flight left none.

    Raises:
        RecordingError: it cannot be read, is damaged, or is not one of framerunner's.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        try:
            self._file: BinaryIO = path.open("rb")
        except OSError as error:
            raise RecordingError(f"recording '{path}': cannot be read: {error.strerror}") from None
        try:
            self._bounded = BoundedFile(self._file)
            self._reader = SeekingReader(
                cast(BinaryIO, self._bounded), validate_crcs=True, record_size_limit=MAX_CHUNK_BYTES
            )
            self._summary = summary_of(self._reader)
            about = self._about()
            self.title = f"{about['scenario']}: {about['mission']}"
            self.result: FlightResult | None = self._attached_result()
        except Exception as error:
            self._file.close()
            raise self._damaged(error) from None

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def events(self) -> Iterator[Event]:
        """All events, in order of vehicle time.

        Raises:
            RecordingError: the file is damaged.
        """
        topics = (TELEMETRY, SETPOINT, DETECTIONS, MISSION, IMAGE, CROSSING, MAP, PATH, ESTIMATE, TRUTH)
        builder = _EventBuilder()
        try:
            for channel, message in messages(self._bounded, self._summary, topics):
                if channel.topic != IMAGE and len(message.data) > _MAX_TEXT_BYTES:
                    raise RecordingError(f"a message of {channel.topic} has {len(message.data)} bytes")
                event = builder.take(channel.topic, message.log_time // 1000, json.loads(message.data))
                if event is not None:
                    yield event
        except Exception as error:
            raise self._damaged(error) from None

    def _attached_result(self) -> FlightResult | None:
        for each in self._reader.iter_attachments():
            if each.name == RESULT:
                try:
                    return FlightResult.parse(each.data)
                except ResultError as error:
                    raise RecordingError(f"its result: {error}") from None
        return None

    def _about(self) -> dict[str, str]:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for record in self._reader.iter_metadata():
                if record.name == METADATA:
                    return record.metadata
        raise RecordingError(
            f"recording '{self._path}': an MCAP file, but not one of framerunner's; open it with Foxglove"
        )

    def _damaged(self, error: Exception) -> RecordingError:
        """Say in one line what is wrong; a damaged file makes the libraries raise any error."""
        if isinstance(error, RecordingError) and str(error).startswith("recording '"):
            return error
        first, last = first_and_last_bytes(self._path)
        if first != MCAP0_MAGIC:
            return RecordingError(
                f"recording '{self._path}': not an MCAP file; name a recording or a run folder"
            )
        if last != MCAP0_MAGIC:
            what = "cut short, as if its program had been killed"
        else:
            is_plain = isinstance(error, McapError | RecordingError)
            text = " ".join(str(error).split()) if is_plain else ""
            what = f"damaged ({text or type(error).__name__:.120})"
        return RecordingError(
            f"recording '{self._path}': {what}; `mcap recover` of the MCAP tools may save a part of it"
        )


class _EventBuilder:
    """Builds events from messages: ticks as the flight's observer got them."""

    def __init__(self) -> None:
        self._state = ""
        self._command = VelocityFluCommand()
        self._detections = Detections()
        self._transition: TransitionTaken | None = None
        self._navigation: NavigationView | None = None
        self._place: PlaceEstimate | None = None

    def take(self, topic: str, time_us: int, message: Json) -> Event | None:
        """Add a message; telemetry is the last of a tick."""
        if topic == TELEMETRY:
            taken, self._transition = self._transition, None
            place, self._place = self._place, None
            return Moment(
                _drone_state(time_us, message),
                self._command,
                self._detections,
                mission_state=self._state,
                flight_time_s=float(message["flight_time_s"]),
                transition=taken,
                navigation=self._navigation,
                place=place,
            )
        if topic == TRUTH:
            return TruePlace(time_us, _vector(message["position_arena_m"]))
        if topic == IMAGE:
            return RecordedImage(time_us, _decoded(b64decode(message["data"])))
        if topic == CROSSING:
            return Crossed(time_us, str(message["colour"]))
        if topic == SETPOINT:
            names = ("forward_m_s", "left_m_s", "up_m_s", "yaw_rate_rad_s")
            self._command = VelocityFluCommand(*(float(message[name]) for name in names))
        elif topic == DETECTIONS:
            self._detections = _detections(message)
        elif topic == MISSION:
            self._state = str(message["state"])
            self._transition = _transition(time_us, message)
        elif topic == ESTIMATE:
            self._place = _place(message)
        elif topic == MAP:
            gates = tuple(map(_gate_estimate, message["frames"][:_MAX_GATES]))
            view = self._navigation or NavigationView()
            self._navigation = replace(view, gates=gates, goal=str(message["goal"]))
        elif topic == PATH:
            path_m = tuple(_vector(pose["position"]) for pose in message["poses"][:_MAX_PATH])
            self._navigation = replace(self._navigation or NavigationView(), path_m=path_m)
        return None


def _vector(message: Json) -> Vec3:
    return (float(message["x"]), float(message["y"]), float(message["z"]))


def _drone_state(time_us: int, message: Json) -> DroneState:
    """Recordings of older versions have no attitude; the drone is then level."""
    yaw_rad, attitude = float(message["yaw_rad"]), message.get("attitude_arena")
    return DroneState(
        time_us,
        *_vector(message["position_arena_m"]),
        yaw_rad,
        _vector(message["velocity_arena_m_s"]),
        bool(message["armed"]),
        bool(message["offboard"]),
        str(message["mode"]),
        bool(message["landed"]),
        float(message.get("position_age_s", 0.0)),
        quaternion_from_yaw(yaw_rad) if attitude is None else (float(attitude["w"]), *_vector(attitude)),
    )


def _place(message: Json) -> PlaceEstimate:
    covariance_m2 = tuple(float(value) for value in message["position_covariance_m2"])
    if len(covariance_m2) != 9 or min(covariance_m2[::4]) < 0.0:
        raise RecordingError(f"a covariance of {ESTIMATE} is none")
    return PlaceEstimate(
        _vector(message["position_arena_m"]),
        float(message["yaw_rad"]),
        covariance_m2,
        float(message["yaw_std_rad"]),
    )


def _gate_estimate(message: Json) -> GateEstimate:
    """An unknown standard deviation is infinite; older recordings have no shapes."""
    std = message.get("position_std_m")
    return GateEstimate(
        str(message["colour"]),
        _vector(message["position_arena_m"]),
        float(message["yaw_rad"]),
        (inf, inf, inf) if std is None else _vector(std),
        float(message.get("yaw_std_rad", inf)),
        bool(message["ambiguous"]),
        bool(message["certain"]),
        int(message["views"]),
        _time_us(message["seen"]),
        GateShape(**message.get("shape", {})),
    )


def _time_us(message: Json) -> int:
    return int(message["sec"]) * 1_000_000 + int(message["nsec"]) // 1000


def _transition(time_us: int, message: Json) -> TransitionTaken | None:
    """Why the mission changed its state; None at its start and in recordings of older versions."""
    if "when" not in message:
        return None
    values = tuple((str(each["name"]), _value(each)) for each in message["values"])
    return TransitionTaken(
        str(message["previous"]),
        str(message["state"]),
        str(message["when"]),
        values,
        time_us,
        float(message["previous_s"]),
        tuple(map(str, message.get("transitions", ())[:_MAX_IDS])),
    )


def _value(message: Json) -> Plain:
    """A guard's value; None for a number that was not finite."""
    return plain_value(next((message[kind] for kind in ("number", "flag", "text") if kind in message), None))


def _detections(message: Json) -> Detections:
    image_time = message.get("image_timestamp")
    time_us = None if image_time is None else _time_us(image_time)
    red, green, blue = (_detection(message[colour]) for colour in ("red", "green", "blue"))
    return Detections(red, green, blue, time_us)


def _detection(message: Json) -> Detection:
    """What is missing is unknown, as in `Detection`'s defaults."""
    return Detection(**{name: float(value) for name, value in message.items() if name != "seen"})


def _decoded(data: bytes) -> Image:
    """Decode a PNG or JPEG; one that is too large, or takes too long, is refused by its structure alone.

    Raises:
        RecordingError: it is refused.
        ValueError: it is damaged.
    """
    try:
        if data.startswith(JPEG_START):
            jpeg_structure(data)
        else:
            _check_png(data)
    except ImageError as error:
        raise RecordingError(f"an image is {error}") from None
    image = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    if image is None:
        raise ValueError("an image cannot be decoded")
    return np.asarray(image, np.uint8)


def _check_png(data: bytes) -> None:
    """Check width and height in the first chunk (PNG specification, 11.2.2)."""
    if not data.startswith(_PNG_START) or len(data) < 24:
        raise ImageError("neither PNG nor JPEG")
    width, height = int.from_bytes(data[16:20]), int.from_bytes(data[20:24])
    if width * height > MAX_PIXELS:
        raise ImageError(f"of {width} x {height} pixels; {MAX_PIXELS} are the limit")
