"""Malicious files: some kilobytes that would unpack to gigabytes are refused before they are unpacked."""

import base64
import json
import resource
import zlib

import cv2
import numpy as np
import pytest
from mcap.writer import CompressionType, Writer

from framerunner.recording.collected import collect
from framerunner.recording.events import RecordingError
from framerunner.recording.mcap_file import MAX_CHUNK_BYTES
from framerunner.recording.mcap_reader import McapRecording
from framerunner.recording.open_recording import recorded_flight
from tests.framerunner.recording.logs import write_log

CLAIMED = (
    b"\x00\x40\x00\x00\x00\x00\x00\x00"  # 16384, little-endian, replaces the size in the index and chunk
)


def recording_of(path, *texts, topic="/telemetry", compression=CompressionType.ZSTD, copies=1):
    """A file as the writer makes them, with messages of given texts in one chunk."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=1 << 30, compression=compression)
        writer.start(library="framerunner")
        writer.add_metadata("framerunner", {"scenario": "s", "mission": "m"})
        channel = writer.register_channel(topic, "json", writer.register_schema("x", "jsonschema", b"{}"))
        for text in texts * copies:
            writer.add_message(channel, 0, text, 0, 0)
        writer.finish()
    return path


def peak_mb():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def read_all(path):
    with recorded_flight(path) as recorded:
        return list(recorded.events())


@pytest.mark.parametrize("compression", [CompressionType.ZSTD, CompressionType.LZ4])
def test_a_chunk_that_is_larger_than_a_recording_s_is_not_unpacked(tmp_path, compression):
    path = recording_of(tmp_path / "bomb.mcap", b" " * (8 * MAX_CHUNK_BYTES), compression=compression)
    assert path.stat().st_size < 1_000_000
    before_mb = peak_mb()
    with pytest.raises(RecordingError, match=r"damaged \(a chunk is said to hold \d+ bytes"):
        read_all(path)
    assert peak_mb() - before_mb < 30


def test_a_chunk_that_claims_a_wrong_size_is_not_unpacked(tmp_path):
    size = 8 * MAX_CHUNK_BYTES
    path = recording_of(tmp_path / "wrong-size.mcap", b" " * size)
    data = path.read_bytes()
    record = 9 + 22 + size  # of the message; after the schema's and the channel's
    claimed = next(
        n.to_bytes(8, "little") for n in range(record, record + 500) if n.to_bytes(8, "little") in data
    )
    path.write_bytes(data.replace(claimed, CLAIMED))
    before_mb = peak_mb()
    with pytest.raises(RecordingError, match="another number of bytes than it says"):
        read_all(path)
    assert peak_mb() - before_mb < 30


def test_no_memory_is_allocated_for_a_length_beyond_the_file(tmp_path):
    path = recording_of(tmp_path / "long.mcap", b"{}")
    data = path.read_bytes()
    place = data.index(b"zstd") + 4  # the length of the packed data follows
    path.write_bytes(data[:place] + (1 << 40).to_bytes(8, "little") + data[place + 8 :])
    before_mb = peak_mb()
    with pytest.raises(RecordingError, match="is said to have 1099511627776 bytes"):
        read_all(path)
    assert peak_mb() - before_mb < 30


def test_a_file_without_an_index_is_refused(tmp_path):
    path = tmp_path / "bare.mcap"
    with path.open("wb") as file:
        writer = Writer(file, use_chunking=False)
        writer.start(library="framerunner")
        writer.finish()
    with pytest.raises(RecordingError, match=r"damaged \(it has no index\)"):
        McapRecording(path)


def image_message(data):
    return json.dumps({"data": base64.b64encode(data).decode()}).encode()


def wide_png():
    """A PNG whose header claims 8000 x 8000 pixels."""
    data = cv2.imencode(".png", np.zeros((4, 4, 3), np.uint8))[1].tobytes()
    head = data[12:16] + (8000).to_bytes(4, "big") * 2 + data[24:29]
    return data[:12] + head + zlib.crc32(head).to_bytes(4, "big") + data[33:]


def many_scans():
    """A JPEG that repeats a scan."""
    data = cv2.imencode(".jpg", np.zeros((16, 16, 3), np.uint8))[1].tobytes()
    scan = data[data.index(b"\xff\xda") : -2]
    return data[:-2] + scan * 1000 + b"\xff\xd9"


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (wide_png(), "an image is of 8000 x 8000 pixels"),
        (many_scans(), "an image is of more than 3 scans"),
        (b"no image", "an image is neither PNG nor JPEG"),
    ],
)
def test_an_image_that_costs_too_much_is_not_decoded(tmp_path, data, words):
    path = recording_of(tmp_path / "image.mcap", image_message(data), topic="/camera/image")
    with recorded_flight(path) as recorded, pytest.raises(RecordingError, match=words):
        collect(recorded)


def test_a_long_text_is_not_parsed(tmp_path):
    path = recording_of(tmp_path / "text.mcap", b"[" + b"{}," * 1_000_000 + b"{}]")
    with pytest.raises(RecordingError, match="a message of /telemetry has 3000004 bytes"):
        read_all(path)


def test_a_log_of_more_than_eight_hours_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("framerunner.recording.tlog_reader.MAX_TICKS", 50)
    write_log(tmp_path / "flight.tlog")
    with pytest.raises(RecordingError, match="longer than eight hours"):
        read_all(tmp_path)


@pytest.mark.parametrize("text", ["[" * 100_000, "{}" + " " * 1_000_000])
def test_a_result_that_costs_too_much_is_refused_in_one_line(tmp_path, text):
    (tmp_path / "result.json").write_text(text, encoding="utf-8")
    with pytest.raises(RecordingError, match="damaged") as told:
        read_all(tmp_path)
    assert "\n" not in str(told.value)
