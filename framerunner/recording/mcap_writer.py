"""Writes a flight as an MCAP file that Foxglove opens and `framerunner replay` shows again.

All times are vehicle time since its boot, so two equal flights leave equal bytes. Messages are written in
compressed chunks of about a megabyte; at most one is in memory. Raw images are compressed in a thread.
"""

from __future__ import annotations

import json
from concurrent.futures import Future, ThreadPoolExecutor
from importlib import metadata
from pathlib import Path

import cv2
from mcap.writer import CompressionType, Writer

from framerunner.files.text_file import read_text
from framerunner.recording import recording_messages, schemas
from framerunner.recording.events import RecordingError
from framerunner.runs import run_files
from framerunner.runs.track import Track
from offboard.app import Moment
from offboard.mission import Mission
from offboard.navigation.view import NavigationView
from offboard.pilot_file import PilotFile
from scenarios.loader import dump_yaml
from scenarios.models import Scenario
from scenarios.result import FlightResult
from vision.types import CameraFrame, Detections, Image

METADATA = "framerunner"
CHUNK_BYTES = 1 << 20
_encode = json.JSONEncoder(separators=(",", ":"), allow_nan=False).encode


class FlightRecording:
    """The recording of one flight.

    A full disk does not end a flight: recording stops, and `problem` says why.

    Args:
        path: the file to write.
        scenario: what is flown; attached.
        mission: its file is attached, and a contestant's Python file.
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
        self._counts = dict.fromkeys(schemas.TOPICS, 0)
        self._scene_written = False
        self._first_us: int | None = None
        self._now_us: int | None = None
        self._state = ""
        self._state_since_us = 0
        self._detections = Detections()
        self._navigation = NavigationView()
        self._compressor = ThreadPoolExecutor(1, "compress images")
        self._compressing: tuple[int, Future[bytes]] | None = None
        try:
            self._file = path.open("wb")
        except OSError as error:
            raise RecordingError(f"recording: cannot write '{path}': {error.strerror}") from None
        self._writer = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._begin(mission, seed)

    def __enter__(self) -> FlightRecording:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def see(self, moment: Moment) -> None:
        """Record a tick."""
        time_us = moment.state.time_us
        self._now_us = time_us
        if self._first_us is None:
            self._first_us = time_us
        if moment.mission_state != self._state or moment.transition is not None:
            self._enter_state(moment)
        if moment.detections != self._detections:
            self._detect(moment.detections, time_us)
        if moment.navigation is not None:
            self._navigate(moment.navigation, time_us)
        if moment.place is not None:
            self._write(schemas.ESTIMATE, time_us, recording_messages.estimate(moment.place, time_us))
            self._write(
                schemas.ESTIMATE_SCENE, time_us, recording_messages.estimate_scene(moment.place, time_us)
            )
        self._write(schemas.SETPOINT, time_us, recording_messages.setpoint(moment))
        self._write(schemas.TRANSFORM, time_us, recording_messages.transform(moment.state))
        self._write(schemas.TELEMETRY, time_us, recording_messages.telemetry(moment))

    def see_image(self, time_us: int, image: Image) -> None:
        """Record a raw image, without loss.

        Args:
            time_us: vehicle time of its exposure, microseconds.
            image: BGR, shape (height, width, 3), uint8; must not be changed afterwards.
        """
        self._size_px = (image.shape[1], image.shape[0])
        self._keep_compressed()
        self._compressing = (time_us, self._compressor.submit(_png, image))

    def see_frame(self, frame: CameraFrame) -> None:
        """Record an image of a camera, as it was compressed if it was.

        One without a time gets that of the last tick; before the first tick it is left out.
        """
        time_us = self._now_us if frame.time_us is None else frame.time_us
        if time_us is None:
            return
        if frame.jpeg is None:
            self.see_image(time_us, frame.image)
        else:
            self._size_px = (frame.image.shape[1], frame.image.shape[0])
            self._write(schemas.IMAGE, time_us, recording_messages.image(frame.jpeg, "jpeg", time_us))

    def finish(self, result: FlightResult, track: Track) -> None:
        """Add what is known only after the flight: crossings, the true path, the verdict, and the result.

        Args:
            result: without wall times; attached.
            track: of the recorded ticks.
        """
        self._keep_compressed()
        end_us = self._now_us or 0
        if self._first_us is not None and track.time_s:
            began_us = self._first_us - round(track.time_s[0] * 1e6)
            self._cross_gates(result, began_us)
            for time_s, *position_m in track.true_path:
                x, y, z = position_m
                time_us = began_us + round(time_s * 1e6)
                self._write(schemas.TRUTH, time_us, recording_messages.truth((x, y, z), time_us))
            self._log(end_us, "referee", result.reason)
        self._attach(run_files.RESULT, "application/json", result.text(), end_us)

    def close(self) -> None:
        """Finish the file, or remove it if nothing was recorded; a second call does nothing."""
        self._compressor.shutdown()
        if self._file.closed:
            return
        try:
            self._keep_compressed()
            if not self.problem:
                self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.close()
            if not self._scene_written:
                self._path.unlink()
        except OSError as error:
            self._stop(error)

    def _begin(self, mission: Mission, seed: int | None) -> None:
        version = metadata.version("framerunner")
        self._writer.start(library=f"framerunner {version}")
        about = {"version": version, "scenario": self._scenario.name, "mission": mission.name}
        self._writer.add_metadata(METADATA, {**about, "seed": "" if seed is None else str(seed)})
        self._attach(run_files.SCENARIO, "application/yaml", dump_yaml(self._scenario), 0)
        self._attach(run_files.MISSION, "application/yaml", read_text(mission.path), 0)
        if isinstance(mission.pilot, PilotFile):
            self._attach(run_files.PILOT, "text/x-python", mission.pilot.text, 0)
        register = self._writer.register_schema
        ids = {name: register(name, "jsonschema", text) for name, text in schemas.schema_texts().items()}
        for topic, name in schemas.TOPICS.items():
            self._channels[topic] = self._writer.register_channel(topic, "json", ids[name])

    def _write_scene(self, time_us: int) -> None:
        """Write what does not change, before all else, at the time of the first message."""
        self._scene_written = True
        self._write(schemas.SCENE, time_us, recording_messages.scene(self._scenario, time_us))
        self._write(schemas.TRANSFORM, time_us, recording_messages.camera_transform(self._scenario, time_us))
        self._write(schemas.CALIBRATION, time_us, recording_messages.calibration(self._scenario, time_us))

    def _enter_state(self, moment: Moment) -> None:
        time_us = moment.state.time_us
        previous_s = (time_us - self._state_since_us) / 1e6 if self._state else 0.0
        self._write(
            schemas.MISSION, time_us, recording_messages.mission_state(moment, self._state, previous_s)
        )
        previous = f" after {previous_s:.2f} s in {self._state}" if self._state else ""
        self._log(time_us, "mission", f"{moment.mission_state}{previous}")
        self._state, self._state_since_us = moment.mission_state, time_us

    def _detect(self, seen: Detections, time_us: int) -> None:
        self._detections = seen
        self._write(schemas.DETECTIONS, time_us, recording_messages.detections(seen, time_us))
        image_us = time_us if seen.time_us is None else seen.time_us
        self._write(schemas.ANNOTATIONS, image_us, recording_messages.boxes(seen, image_us, self._size_px))

    def _navigate(self, view: NavigationView, time_us: int) -> None:
        """Write what of the map and the plan has changed."""
        last, self._navigation = self._navigation, view
        if (view.gates, view.goal) != (last.gates, last.goal):
            self._write(schemas.MAP, time_us, recording_messages.gate_map(view, time_us))
            self._write(schemas.MAP_SCENE, time_us, recording_messages.map_scene(view, time_us))
        if view.path_m != last.path_m:
            self._write(schemas.PATH, time_us, recording_messages.path(view, time_us))

    def _keep_compressed(self) -> None:
        """Write the last raw image.

        Always when the next one arrives, so that the file's bytes do not depend on the thread's speed.
        """
        if self._compressing is not None:
            time_us, data = self._compressing
            self._compressing = None
            self._write(schemas.IMAGE, time_us, recording_messages.image(data.result(), "png", time_us))

    def _cross_gates(self, result: FlightResult, began_us: int) -> None:
        rows = zip(
            result.frames_crossed,
            result.crossing_times_s,
            result.crossing_offsets_m,
            result.crossing_sides,
            strict=True,
        )
        for colour, time_s, offset_m, side in rows:
            time_us = began_us + round(time_s * 1e6)
            self._write(
                schemas.CROSSING,
                time_us,
                recording_messages.crossing(time_us, colour, time_s, offset_m, side),
            )
            self._log(time_us, "referee", f"crossed {colour}, {100 * offset_m:.1f} cm off its centre")

    def _log(self, time_us: int, name: str, text: str) -> None:
        self._write(schemas.LOG, time_us, recording_messages.log(time_us, name, text))

    def _write(self, topic: str, time_us: int, message: recording_messages.Message) -> None:
        if self.problem:
            return
        if not self._scene_written:
            self._write_scene(time_us)
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
        """Stop recording; what is in the file already can be read."""
        self.problem = f"recording stopped: {error.strerror or error}"
        try:
            self._file.close()
        except OSError:  # what was buffered does not fit either; the file is closed anyway
            return


def _png(image: Image) -> bytes:
    """Compress without loss; OpenCV's defaults are its fastest."""
    return bytes(cv2.imencode(".png", image)[1])
