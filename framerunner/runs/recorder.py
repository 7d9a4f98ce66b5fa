"""Records a flight while it is flown: its latest tick, its pace and its images."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import AsyncIterator, Callable
from concurrent.futures import Future, ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import cv2

from framerunner.runs.run_folder import RunFolder
from framerunner.runs.track import Track
from offboard.app import Moment
from scenarios.result import FlightResult
from vision.types import CameraFrame, Image

if TYPE_CHECKING:
    from framerunner.recording.mcap_writer import FlightRecording
    from offboard.perception import ImageSource

_MAX_WAITING_BYTES = 12 << 20  # of images that wait to be compressed: 50 of 320 x 240 pixels


class FlightRecorder:
    """Records the latest tick of a flight, and wall time beside vehicle time.

    Attributes:
        latest: tick; None before the first.
        paused: an operator has had the sticks.
    """

    def __init__(self) -> None:
        self._first: tuple[float, int] | None = None
        self._last: tuple[float, int] | None = None
        self.latest: Moment | None = None
        self.paused = False

    def see(self, moment: Moment) -> None:
        """Record a tick."""
        self._last = (time.monotonic(), moment.state.time_us)
        self._first = self._first or self._last
        self.latest = moment
        self.paused = self.paused or moment.paused

    @property
    def wall_time_s(self) -> float:
        """Wall time from the first to the last tick."""
        return 0.0 if self._first is None or self._last is None else self._last[0] - self._first[0]

    @property
    def real_time_factor(self) -> float | None:
        """Vehicle time a wall time; None before two ticks."""
        if self._first is None or self._last is None or self.wall_time_s <= 0.0:
            return None
        return (self._last[1] - self._first[1]) / 1e6 / self.wall_time_s


class VideoFile:
    """Writes images to a video file (motion JPEG in AVI, which every player supports), in a thread.

    Args:
        path: the video; made with the first image.
        rate_hz: images a second, for players.

    Attributes:
        problem: why the file is incomplete, set when it is closed; empty if it is complete.
    """

    def __init__(self, path: Path, rate_hz: float) -> None:
        self.problem = ""
        self._path = path
        self._rate_hz = rate_hz
        self._writer: cv2.VideoWriter | None = None
        self._worker = ThreadPoolExecutor(1, "video")
        self._size: tuple[int, ...] = ()
        self._waiting: deque[Future[None]] = deque()

    def write(self, image: Image, *, wait: bool = True) -> None:
        """Add an image; one whose size differs from the first is left out.

        Args:
            image: BGR; it must not be changed afterwards.
            wait: if too many images wait to be compressed, wait until there is room; if false, the image is
                left out.
        """
        self._size = self._size or image.shape
        if image.shape != self._size:
            return
        while self._waiting and self._waiting[0].done():
            self._waiting.popleft().result()
        if len(self._waiting) * image.nbytes > _MAX_WAITING_BYTES:
            if not wait:
                return
            self._waiting.popleft().result()
        self._waiting.append(self._worker.submit(self._compress, image))

    def close(self) -> None:
        """Finish the file."""
        self._worker.shutdown()
        if self._writer is not None:
            self._writer.release()
            self._writer = None
            if not _is_complete_avi(self._path):
                self.problem = f"'{self._path}' is incomplete: not all of it could be written"

    def _compress(self, image: Image) -> None:
        if self._writer is None:
            height, width = image.shape[:2]
            codec = cv2.VideoWriter.fourcc(*"MJPG")
            self._writer = cv2.VideoWriter(str(self._path), codec, self._rate_hz, (width, height))
        self._writer.write(image)


def _is_complete_avi(path: Path) -> bool:
    """Whether the file is as long as its header says.

    OpenCV does not report failed writes; it writes the length last, after the index.
    """
    try:
        with path.open("rb") as file:
            head = file.read(12)
        written = int.from_bytes(head[4:8], "little") + 8
        return head[:4] == b"RIFF" and written <= path.stat().st_size
    except OSError:
        return False


class RecordingCamera:
    """A camera whose images are also written to a video file, if one is wanted.

    Args:
        source: the camera.
        path: the video; made with the first image. None: there is none.
        rate_hz: images a second, for players.
        on_frame: called with each image.
    """

    def __init__(
        self,
        source: ImageSource,
        path: Path | None,
        rate_hz: float,
        on_frame: Callable[[CameraFrame], None] | None = None,
    ) -> None:
        self._source = source
        self._on_frame = on_frame
        self._video = None if path is None else VideoFile(path, rate_hz)

    async def frames(self) -> AsyncIterator[CameraFrame]:
        """Images as they arrive, each after it was added to the video."""
        async for frame in self._source.frames():
            if self._video is not None:
                self._video.write(frame.image, wait=False)
            if self._on_frame is not None:
                self._on_frame(frame)
            yield frame

    def close(self) -> None:
        """Finish the file."""
        if self._video is not None:
            self._video.close()

    @property
    def problem(self) -> str:
        """Of the video, see `VideoFile`."""
        return "" if self._video is None else self._video.problem


class RunRecords:
    """All that records a flight of `framerunner fly`.

    Attributes:
        folder: where it is kept.
        recorder: the latest tick and the pace.
        recording: the MCAP file; None without `--record`.
    """

    def __init__(self, folder: RunFolder, recording: FlightRecording | None) -> None:
        self._started = datetime.now(UTC)
        self.folder = folder
        self.recorder = FlightRecorder()
        self.recording = recording
        self._keeper = ThreadPoolExecutor(1, "unfinished result")  # a slow disk must not delay a flight
        self._kept: Future[None] | None = None

    def see(self, moment: Moment) -> None:
        """Record a tick."""
        self.recorder.see(moment)
        if self.recording is not None:
            self.recording.see(moment)

    def see_image(self, time_us: int, image: Image) -> None:
        """Record a raw image of the simulated camera, and its vehicle time."""
        if self.recording is not None:
            self.recording.see_image(time_us, image)

    def see_frame(self, frame: CameraFrame) -> None:
        """Record an image of a camera."""
        if self.recording is not None:
            self.recording.see_frame(frame)

    def complete(self, result: FlightResult) -> FlightResult:
        """Return a result with its wall times, as `result.json` has it."""
        wall = {
            "wall_time_s": self.recorder.wall_time_s,
            "real_time_factor": self.recorder.real_time_factor,
            "started": self._started.isoformat(timespec="seconds"),
        }
        return result.model_copy(update=wall)

    def keep_unfinished(self, result: FlightResult) -> None:
        """Keep what the result is to be if this program is ended now; not while the last is being written."""
        if self._kept is None or self._kept.done():
            self._kept = self._keeper.submit(self.folder.keep_unfinished, self.complete(result))

    def stop_keeping(self) -> None:
        """Wait until it is kept; afterwards there is no more."""
        self._keeper.shutdown()

    def finish(self, result: FlightResult, track: Track) -> None:
        """Add the result to the recording."""
        if self.recording is not None:
            self.recording.finish(result, track)
