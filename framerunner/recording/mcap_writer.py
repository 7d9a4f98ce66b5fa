"""Writes a flight as an MCAP file that Foxglove opens and `framerunner replay` shows again.

All times are vehicle time since its boot, so two same flights leave the same bytes. Messages go to the file
in compressed chunks of about a megabyte; no more than one of them is in memory. Raw images are compressed in
a thread of their own, beside the flight.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from importlib import metadata
from pathlib import Path
from types import TracebackType

import cv2
from mcap.writer import CompressionType, Writer

from framerunner.recording import messages
from framerunner.recording.errors import RecordingError
from framerunner.recording.scene import calibration, camera_transform, scene
from framerunner.recording.schemas import (
    ANNOTATIONS,
    CALIBRATION,
    CROSSING,
    DETECTIONS,
    IMAGE,
    LOG,
    MISSION,
    SCENE,
    SETPOINT,
    TELEMETRY,
    TOPICS,
    TRANSFORM,
    schemas,
)
from offboard.app import Moment
from offboard.mission import Mission
from offboard.pilot_file import PilotFile
from scenarios.loader import dump_yaml
from scenarios.models import Scenario
from scenarios.result import FlightResult
from vision.types import CameraFrame, Detections, Image

METADATA = "framerunner"
CHUNK_BYTES = 1 << 20
_encode = json.JSONEncoder(separators=(",", ":"), allow_nan=False).encode


class FlightRecording:
    """The recording of one flight, from before it begins.

    A disk that is full does not end a flight: recording stops, and `problem` says why.

    Args:
        path: the file to write.
        scenario: what is flown; attached.
        mission: what flies; its file is attached, and a contestant's Python file with it.
        seed: of a lockstep flight; None in real time.

    Attributes:
        problem: why recording stopped before the flight did; empty if it did not.

    Raises:
        RecordingError: the file cannot be written.
    """

    def __init__(self, path: Path, scenario: Scenario, mission: Mission, seed: int | None) -> None:
        self.problem = ""
        self._path = path
        self._scenario = scenario
        self._size_px = (scenario.camera.width_px, scenario.camera.height_px)
        self._channels: dict[str, int] = {}
        self._counts = dict.fromkeys(TOPICS, 0)
        self._shown = False
        self._first_us: int | None = None
        self._now_us: int | None = None
        self._state = ""
        self._state_since_us = 0
        self._detections = Detections()
        self._compressor = ThreadPoolExecutor(1, "compress images")
        self._compressing: tuple[int, Future[bytes]] | None = None
        try:
            self._file = path.open("wb")
        except OSError as error:
            raise RecordingError(f"recording: cannot write '{path}': {error.strerror}") from None
        self._writer = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._begin(mission, seed)

    def __enter__(self) -> FlightRecording:
        """Record until the end of the block, whatever ends it."""
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        """Finish the file."""
        self.close()

    def see(self, moment: Moment) -> None:
        """Take a tick of the flight."""
        time_us = moment.state.time_us
        self._now_us = time_us
        if self._first_us is None:
            self._first_us = time_us
        if moment.mission_state != self._state:
            self._enter_state(moment)
        if moment.detections != self._detections:
            self._detect(moment.detections, time_us)
        self._write(SETPOINT, time_us, messages.setpoint(moment))
        self._write(TRANSFORM, time_us, messages.transform(moment.state))
        self._write(TELEMETRY, time_us, messages.telemetry(moment))

    def see_image(self, time_us: int, image: Image) -> None:
        """Take a raw image; it is kept without loss.

        Args:
            time_us: vehicle time of its exposure, microseconds.
            image: BGR, shape (height, width, 3), uint8; must not be changed afterwards.
        """
        self._size_px = (image.shape[1], image.shape[0])
        self._keep_compressed()
        self._compressing = (time_us, self._compressor.submit(_png, image))

    def see_frame(self, frame: CameraFrame) -> None:
        """Take an image of a camera source, as it was compressed if it was.

        One without a time gets that of the last tick; before the first tick it has none and is left out.
        """
        time_us = self._now_us if frame.time_us is None else frame.time_us
        if time_us is None:
            return
        if frame.jpeg is None:
            self.see_image(time_us, frame.image)
        else:
            self._size_px = (frame.image.shape[1], frame.image.shape[0])
            self._write(IMAGE, time_us, messages.image(frame.jpeg, "jpeg", time_us))

    def finish(self, result: FlightResult, track_time_s: Sequence[float]) -> None:
        """Add what is known only after the flight: crossings, the verdict, and the result as an attachment.

        Args:
            result: without wall times.
            track_time_s: of the ticks seen, since motors on; it tells when the try began.
        """
        self._keep_compressed()
        end_us = self._now_us or 0
        if self._first_us is not None and track_time_s:
            began_us = self._first_us - round(track_time_s[0] * 1e6)
            self._cross_frames(result, began_us)
            self._log(end_us, "referee", result.reason)
        self._attach("result.json", "application/json", result.text(), end_us)

    def close(self) -> None:
        """Finish the file, or take it away if there was nothing to record; a second time does nothing."""
        self._compressor.shutdown()
        if self._file.closed:
            return
        try:
            self._keep_compressed()
            if not self.problem:
                self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()
            if not self._shown:
                self._path.unlink()
        except OSError as error:
            self._stop(error)

    def _begin(self, mission: Mission, seed: int | None) -> None:
        version = metadata.version("framerunner")
        self._writer.start(library=f"framerunner {version}")
        about = {"version": version, "scenario": self._scenario.name, "mission": mission.name}
        self._writer.add_metadata(METADATA, {**about, "seed": "" if seed is None else str(seed)})
        self._attach("scenario.yaml", "application/yaml", dump_yaml(self._scenario), 0)
        self._attach("mission.yaml", "application/yaml", mission.path.read_text(encoding="utf-8"), 0)
        if isinstance(mission.pilot, PilotFile):
            self._attach("pilot.py", "text/x-python", mission.pilot.text, 0)
        ids = {
            name: self._writer.register_schema(name, "jsonschema", text) for name, text in schemas().items()
        }
        for topic, name in TOPICS.items():
            self._channels[topic] = self._writer.register_channel(topic, "json", ids[name])

    def _show(self, time_us: int) -> None:
        """What does not change stands before all else, at the time of the first message."""
        self._shown = True
        self._write(SCENE, time_us, scene(self._scenario, time_us))
        self._write(TRANSFORM, time_us, camera_transform(self._scenario, time_us))
        self._write(CALIBRATION, time_us, calibration(self._scenario, time_us))

    def _enter_state(self, moment: Moment) -> None:
        time_us = moment.state.time_us
        previous_s = (time_us - self._state_since_us) / 1e6 if self._state else 0.0
        self._write(MISSION, time_us, messages.mission_state(moment, self._state, previous_s))
        came_from = f" after {previous_s:.2f} s in {self._state}" if self._state else ""
        self._log(time_us, "mission", f"{moment.mission_state}{came_from}")
        self._state, self._state_since_us = moment.mission_state, time_us

    def _detect(self, seen: Detections, time_us: int) -> None:
        self._detections = seen
        self._write(DETECTIONS, time_us, messages.detections(seen, time_us))
        image_us = time_us if seen.time_us is None else seen.time_us
        self._write(ANNOTATIONS, image_us, messages.boxes(seen, image_us, self._size_px))

    def _keep_compressed(self) -> None:
        """Write the last raw image.

        Always when the next one comes, so that the file's bytes do not hang on how quick the thread is.
        """
        if self._compressing is not None:
            time_us, data = self._compressing
            self._compressing = None
            self._write(IMAGE, time_us, messages.image(data.result(), "png", time_us))

    def _cross_frames(self, result: FlightResult, began_us: int) -> None:
        rows = zip(
            result.frames_crossed,
            result.crossing_times_s,
            result.crossing_offsets_m,
            result.crossing_sides,
            strict=True,
        )
        for colour, time_s, offset_m, side in rows:
            time_us = began_us + round(time_s * 1e6)
            self._write(CROSSING, time_us, messages.crossing(time_us, colour, time_s, offset_m, side))
            self._log(time_us, "referee", f"crossed {colour}, {100 * offset_m:.1f} cm off its centre")

    def _log(self, time_us: int, name: str, text: str) -> None:
        self._write(LOG, time_us, messages.log(time_us, name, text))

    def _write(self, topic: str, time_us: int, message: messages.Message) -> None:
        if self.problem:
            return
        if not self._shown:
            self._show(time_us)
        data = _encode(message).encode()
        number = self._counts[topic]
        self._counts[topic] = number + 1
        time_ns = time_us * 1000
        try:
            self._writer.add_message(self._channels[topic], time_ns, data, time_ns, number)
        except OSError as error:
            self._stop(error)

    def _attach(self, name: str, kind: str, text: str, time_us: int) -> None:
        if self.problem:
            return
        try:
            self._writer.add_attachment(0, time_us * 1000, name, kind, text.encode())
        except OSError as error:
            self._stop(error)

    def _stop(self, error: OSError) -> None:
        """Go on without recording; what is in the file already can be read."""
        self.problem = f"recording stopped: {error.strerror or error}"
        try:
            self._file.close()
        except OSError:  # what was buffered does not fit either; the file is closed all the same
            return


def _png(image: Image) -> bytes:
    """Compress without loss; OpenCV's defaults are its quickest."""
    return bytes(cv2.imencode(".png", image)[1])
