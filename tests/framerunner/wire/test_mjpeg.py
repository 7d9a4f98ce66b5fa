"""MJPEG: streams of real cameras, and invalid ones."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.wire.mjpeg import (
    STREAM_HEADERS,
    STREAM_START,
    MjpegPart,
    MjpegReader,
    StreamError,
    write_part,
)

CUT = "multipart/x-mixed-replace; boundary=cut"


def part(data: bytes, head: str = "", *, length: bool = True) -> bytes:
    lines = f"Content-Type: image/jpeg\r\n{head}" + (f"Content-Length: {len(data)}\r\n" if length else "")
    return b"--cut\r\n" + lines.encode() + b"\r\n" + data + b"\r\n"


@pytest.mark.parametrize("length", [True, False])
@pytest.mark.parametrize("size", [1, 2, 7, 1000])
def test_parts_in_pieces_of_any_size(size: int, *, length: bool) -> None:
    bodies = [b"\xff\xd8one\xff\xd9", b"t\r\nw\r\n\r\no", b"x" * 300]
    stream = (
        b"".join(part(body, f"X-Time-Us: {i}\r\n", length=length) for i, body in enumerate(bodies))
        + b"--cut--\r\n"
    )
    reader = MjpegReader(CUT)
    got = [one for at in range(0, len(stream), size) for one in reader.feed(stream[at : at + size])]
    assert got == [MjpegPart(body, i) for i, body in enumerate(bodies)]


def test_boundary_with_dashes_bare_newlines_and_noise() -> None:
    reader = MjpegReader("multipart/x-mixed-replace; boundary=--cut")
    stream = b"noise\n\n--cut\nContent-Length: 3\n\nabc" + b"junk" * 1000 + b"--cut\n\ndef\r\n--cut"
    assert reader.feed(stream) == [MjpegPart(b"abc", None), MjpegPart(b"def", None)]


@pytest.mark.parametrize(
    ("line", "time_us"),
    [
        ("X-Time-Us: 12", 12),
        ("x-time-us:  12  ", 12),
        ("X-Time-Us: -12", None),
        ("X-Time-Us: 1e9", None),
        ("X-Time-Us: " + "9" * 19, None),
        ("X-Time-Us: ١٢", None),
        ("X-Time-Us:", None),
        ("Not-X-Time-Us: 12", None),
    ],
)
def test_only_a_sound_time_counts(line: str, time_us: int | None) -> None:
    assert MjpegReader(CUT).feed(part(b"abc", line + "\r\n")) == [MjpegPart(b"abc", time_us)]


def test_too_large_a_part_is_refused() -> None:
    with pytest.raises(StreamError, match="a part of 101 bytes is refused; the limit is 100"):
        MjpegReader(CUT, 100).feed(part(b"x" * 101))
    with pytest.raises(StreamError, match="more than 100 bytes"):
        MjpegReader(CUT, 100).feed(part(b"x" * 200, length=False))
    with pytest.raises(StreamError, match="999999999999999999 bytes is refused"):
        MjpegReader(CUT).feed(b"--cut\r\nContent-Length: 999999999999999999\r\n\r\n")


def test_endless_headers_are_refused() -> None:
    with pytest.raises(StreamError, match="headers of a part exceed"):
        MjpegReader(CUT).feed(b"--cut\r\n" + b"A: b\r\n" * 4000)


def test_noise_is_not_kept() -> None:
    reader = MjpegReader(CUT)
    for _ in range(100):
        assert reader.feed(b"-" * 10_000) == []
    assert len(reader._buffer) < 100


@given(
    st.lists(st.binary(max_size=60) | st.sampled_from([b"--cut\r\n", b"\r\n\r\n", b"Content-Length: 5\r\n"]))
)
def test_any_bytes_do_no_harm(chunks: list[bytes]) -> None:
    reader = MjpegReader(CUT)
    for chunk in chunks:
        for one in reader.feed(chunk):
            assert one.data
    assert len(reader._buffer) <= sum(map(len, chunks))


@pytest.mark.parametrize(
    ("content_type", "boundary"),
    [
        ("multipart/x-mixed-replace; boundary=frame", "frame"),
        ('multipart/x-mixed-replace;boundary="a b"', "a b"),
        ("Multipart/X-Mixed-Replace; BOUNDARY=--x; charset=y", "x"),
    ],
)
def test_boundary_of_a_content_type(content_type: str, boundary: str) -> None:
    stream = f"--{boundary}\r\nContent-Length: 3\r\n\r\nabc".encode()
    assert MjpegReader(content_type).feed(stream) == [MjpegPart(b"abc", None)]


@pytest.mark.parametrize(
    "content_type",
    [
        "multipart/x-mixed-replace",
        "multipart/x-mixed-replace; boundary=",
        "multipart/mixed",
        "text/html; boundary=x",
        "image/jpeg",
        "",
    ],
)
def test_another_kind_of_stream_is_refused(content_type: str) -> None:
    with pytest.raises(StreamError, match="not an MJPEG stream: Content-Type is"):
        MjpegReader(content_type)


def test_what_is_written_can_be_read() -> None:
    images = [
        MjpegPart(b"\xff\xd8one\xff\xd9", 7),
        MjpegPart(b"--frame\r\n\r\nx", 1 << 50),
        MjpegPart(b"three", None),
    ]
    stream = STREAM_START + b"".join(write_part(image.data, image.time_us) for image in images)
    assert MjpegReader(STREAM_HEADERS["Content-Type"]).feed(stream) == images
