"""Writes films as MP4, which phones and browsers play, or as GIF."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import av
import numpy as np
from av.codec import Codec
from av.filter import Graph

from framerunner.errors import UserError
from vision.types import Image

if TYPE_CHECKING:
    from av.video.stream import VideoStream

_OPTIONS = {
    "libx264": {"crf": "21", "preset": "medium", "tune": "animation"},
    "mpeg4": {"qscale": "3"},
    "gif": {},
}
_PALETTE_COLOURS = 160  # fewer make smaller files, and flat shades need no more


class FilmError(UserError):
    """A film that cannot be written; the message is one line for people."""


class FilmFile:
    """A film that is being written; `film_file` finishes and closes it.

    An MP4 has H.264 in yuv420p, which every player supports, or MPEG-4; see `mp4_codec`. A GIF repeats, and
    its palette is made from some sample images.

    Args:
        path: the file.
        codec: "gif", or one of `mp4_codec`.
        size_px: width and height of the images; both even.
        fps: images a second.
        samples: of a GIF.
    """

    def __init__(
        self, path: Path, codec: str, size_px: tuple[int, int], fps: float, samples: Sequence[Image] = ()
    ) -> None:
        is_gif = codec == "gif"
        options = {} if is_gif else {"movflags": "+faststart"}
        self._container = av.open(str(path), "w", format="gif" if is_gif else "mp4", options=options)
        self._rate = Fraction(fps).limit_denominator(1000)
        self._size_px = size_px
        self._count = 0
        stream = self._container.add_stream(codec, rate=self._rate, options=_OPTIONS[codec])
        self._stream = cast("VideoStream", stream)
        self._stream.width, self._stream.height = size_px
        self._stream.pix_fmt = "pal8" if is_gif else "yuv420p"
        self._stream.time_base = 1 / self._rate
        if codec == "mpeg4":
            self._stream.bit_rate = 4_000_000
        self._palette_use = self._palette_graph(self._palette(samples)) if is_gif else None

    def add(self, image: Image) -> None:
        """Add an image, BGR, shape (height, width, 3)."""
        if self._palette_use is None:
            self._encode(self._frame(image, self._count, "yuv420p"))
        else:
            self._encode_filtered(self._frame(image, self._count, "rgb32"), *self._palette_use)
        self._count += 1

    def finish(self) -> None:
        """Write the images that filter and encoder still hold."""
        if self._palette_use is not None:
            self._encode_filtered(None, *self._palette_use)
        self._encode(None)

    def close(self) -> None:
        """Close the file."""
        self._container.close()

    def _encode(self, frame: Any) -> None:  # noqa: ANN401 - PyAV's frame, or None at the end
        for packet in self._stream.encode(frame):
            self._container.mux(packet)

    def _encode_filtered(self, frame: Any, graph: Graph, source: Any) -> None:  # noqa: ANN401 - likewise
        source.push(frame)
        for filtered in _pulled(graph):
            self._encode(filtered)

    def _frame(self, image: Image, number: int, pixels: str) -> av.VideoFrame:
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image), format="bgr24")
        frame.pts, frame.time_base = number, 1 / self._rate
        return frame.reformat(format=pixels)

    def _palette(self, samples: Sequence[Image]) -> av.VideoFrame:
        graph = Graph()
        source = self._buffer(graph, self._size_px)
        chosen = graph.add("palettegen", f"max_colors={_PALETTE_COLOURS}:stats_mode=full")
        sink = graph.add("buffersink")
        source.link_to(chosen)
        chosen.link_to(sink)
        graph.configure()
        for number, image in enumerate(samples):
            source.push(self._frame(image, number, "rgb32"))
        source.push(None)
        return next(_pulled(graph))

    def _palette_graph(self, palette: av.VideoFrame) -> tuple[Graph, Any]:
        graph = Graph()
        source = self._buffer(graph, self._size_px)
        colours = self._buffer(graph, (palette.width, palette.height))
        # Without dithering flat shades stay flat and files small.
        use = graph.add("paletteuse", "dither=none:diff_mode=rectangle")
        sink = graph.add("buffersink")
        source.link_to(use, 0, 0)
        colours.link_to(use, 0, 1)
        use.link_to(sink)
        graph.configure()
        palette.pts, palette.time_base = 0, 1 / self._rate
        colours.push(palette)
        colours.push(None)
        return graph, source

    def _buffer(self, graph: Graph, size_px: tuple[int, int]) -> Any:  # noqa: ANN401 - PyAV's filter context
        width, height = size_px
        pixels = av.VideoFormat("rgb32", width, height)
        return graph.add_buffer(width=width, height=height, format=pixels, time_base=1 / self._rate)


def _pulled(graph: Graph) -> Iterator[av.VideoFrame]:
    """Frames that a graph has ready."""
    while True:
        try:
            yield cast("av.VideoFrame", graph.pull())
        except (av.error.BlockingIOError, av.error.EOFError):
            return


def mp4_codec() -> str:
    """H.264's encoder, or "mpeg4" if FFmpeg was built without it."""
    try:
        Codec("libx264", "w")
    except (av.codec.codec.UnknownCodecError, ValueError):
        return "mpeg4"
    return "libx264"


@contextmanager
def film_file(path: Path, open_film: Callable[[Path], FilmFile]) -> Iterator[FilmFile]:
    """Write a film completely or not at all.

    Args:
        path: of the film; replaced at the end of the block.
        open_film: opens it under a temporary name in the same folder.

    Raises:
        FilmError: it cannot be written.
    """
    part = path.with_name(f".{path.name}.part")
    try:
        film = open_film(part)
        try:
            yield film
            film.finish()
        finally:
            film.close()
        part.replace(path)
    except (OSError, av.error.FFmpegError) as error:
        raise FilmError(f"film: cannot write '{path}': {error.strerror or error}") from None
    finally:
        part.unlink(missing_ok=True)
