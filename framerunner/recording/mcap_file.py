"""Reads an MCAP file chunk by chunk, within bounds that do not depend on the sizes that the file claims.

MCAP's own reader unpacks whatever a chunk holds; some kilobytes can unpack to gigabytes.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from heapq import heapify, heappop, heappush
from os import SEEK_END
from pathlib import Path
from typing import BinaryIO

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.reader import SeekingReader
from mcap.records import Channel, Chunk, ChunkIndex, Message
from mcap.stream_reader import breakup_chunk
from mcap.summary import Summary
from mcap.writer import MCAP0_MAGIC

from framerunner.recording.events import RecordingError

MAX_CHUNK_BYTES = 24 << 20
"""Of a chunk, packed or not; the writer ends one at a megabyte and the message that exceeds it."""
_MAX_WAITING_BYTES = 256 << 20  # of messages in memory, with Python's overhead
_MESSAGE_OVERHEAD_BYTES = 400
_RECORD_HEAD_BYTES = 9

_Waiting = tuple[int, int, int, ChunkIndex | Message]


def first_and_last_bytes(path: Path) -> tuple[bytes, bytes]:
    """Of a file; a complete MCAP file has `MCAP0_MAGIC` at both ends. Empty if it cannot be read."""
    length = len(MCAP0_MAGIC)
    try:
        with path.open("rb") as file:
            first = file.read(length)
            file.seek(max(0, file.seek(0, SEEK_END) - length))
            return first, file.read()
    except OSError:
        return b"", b""


class BoundedFile:
    """A file from which at most one chunk is read at a time, whatever length a record claims."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def read(self, size: int = -1) -> bytes:
        """Read some bytes; raises `RecordingError` if they are more than any record may have."""
        if not 0 <= size <= MAX_CHUNK_BYTES:
            raise RecordingError(f"a part of it is said to have {size} bytes; {MAX_CHUNK_BYTES} are the most")
        return self._file.read(size)

    def seek(self, offset: int, whence: int = 0) -> int:
        """See `BinaryIO`."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """See `BinaryIO`."""
        return self._file.tell()


def summary_of(reader: SeekingReader) -> Summary:
    """Return a file's index.

    Raises:
        RecordingError: it has none, or it names a part twice.
    """
    summary = reader.get_summary()
    if summary is None or not summary.chunk_indexes:
        raise RecordingError("it has no index")
    if len({index.chunk_start_offset for index in summary.chunk_indexes}) != len(summary.chunk_indexes):
        raise RecordingError("its index names a chunk twice")
    return summary


def messages(
    file: BoundedFile, summary: Summary, topics: Collection[str]
) -> Iterator[tuple[Channel, Message]]:
    """Yield the messages of some topics in order of their time.

    Raises:
        RecordingError: a chunk is larger than a recording's can be.
    """
    wanted = {number: each for number, each in summary.channels.items() if each.topic in topics}
    waiting: list[_Waiting] = [
        (index.message_start_time, index.chunk_start_offset, -1, index)
        for index in summary.chunk_indexes
        if not index.message_index_offsets or wanted.keys() & index.message_index_offsets.keys()
    ]
    heapify(waiting)
    waiting_bytes = 0
    while waiting:
        _, place, _, item = heappop(waiting)
        if isinstance(item, Message):
            waiting_bytes -= len(item.data) + _MESSAGE_OVERHEAD_BYTES
            yield wanted[item.channel_id], item
            continue
        file.seek(place + _RECORD_HEAD_BYTES)
        chunk = Chunk.read(ReadDataStream(file))  # type: ignore[arg-type]
        for number, record in enumerate(breakup_chunk(_unpacked(chunk), validate_crc=True)):
            if isinstance(record, Message) and record.channel_id in wanted:
                heappush(waiting, (record.log_time, place, number, record))
                waiting_bytes += len(record.data) + _MESSAGE_OVERHEAD_BYTES
        if waiting_bytes > _MAX_WAITING_BYTES:
            raise RecordingError("too much of it is of the same time")


def _unpacked(chunk: Chunk) -> Chunk:
    size, data = chunk.uncompressed_size, chunk.data
    if size > MAX_CHUNK_BYTES:
        raise RecordingError(f"a chunk is said to hold {size} bytes; {MAX_CHUNK_BYTES} are the most")
    if chunk.compression not in ("", "zstd"):
        raise RecordingError(f"compressed by '{chunk.compression:.20}'; recordings use zstd")
    if chunk.compression == "zstd" and size:
        claimed = zstandard.get_frame_parameters(data).content_size
        if claimed not in (size, zstandard.CONTENTSIZE_UNKNOWN):
            raise RecordingError("a chunk holds another number of bytes than it says")
        unpacker = zstandard.ZstdDecompressor(max_window_size=MAX_CHUNK_BYTES)
        data = unpacker.decompress(data, max_output_size=size)
    if len(data) != size:
        raise RecordingError("a chunk holds another number of bytes than it says")
    return replace(chunk, compression="", data=data)
