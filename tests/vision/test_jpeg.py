"""What is seen of a JPEG before it is decoded, and which ones are refused."""

from contextlib import suppress

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.vision.hostile_images import progressive_of_many_scans
from vision.jpeg import ImageError, jpeg_structure

RNG = np.random.default_rng(1)
NOISE = RNG.integers(0, 255, (30, 50, 3)).astype(np.uint8)


def jpeg(*settings: int, image: np.ndarray = NOISE) -> bytes:
    return bytes(cv2.imencode(".jpg", image, list(settings))[1])


def refusal(data: bytes, size_px: tuple[int, int] | None = None) -> str:
    with pytest.raises(ImageError) as refused:
        jpeg_structure(data, size_px)
    return str(refused.value)


@pytest.mark.parametrize("progressive", [False, True])
@pytest.mark.parametrize("interval", [0, 1])
def test_structure_and_every_way_to_be_cut_off(progressive: bool, interval: int) -> None:
    data = jpeg(cv2.IMWRITE_JPEG_PROGRESSIVE, int(progressive), cv2.IMWRITE_JPEG_RST_INTERVAL, interval)
    found = jpeg_structure(data + b"\0\0padding", (50, 30))
    assert (found.size_px, found.progressive, found.size_bytes) == ((50, 30), progressive, len(data))
    assert found.scans == (10 if progressive else 1)
    assert found.is_quick is not progressive
    for end in range(len(data)):
        assert refusal(data[:end]) in ("cut off", "not a JPEG")


def test_only_small_ones_are_quick() -> None:
    assert jpeg_structure(jpeg(image=np.zeros((480, 640, 3), np.uint8))).is_quick
    assert not jpeg_structure(jpeg(image=np.zeros((480, 641, 3), np.uint8))).is_quick
    comment = b"\xff\xfe\xff\xff" + bytes(65533)
    data = jpeg()
    assert not jpeg_structure(data[:2] + comment * 9 + data[2:]).is_quick


BASE = jpeg()
FRAME = BASE.index(b"\xff\xc0")
SCAN = BASE.index(b"\xff\xda")


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (progressive_of_many_scans(1000), "of more than 16 scans"),
        (BASE[:-2] + BASE[SCAN:-2] * 3 + BASE[-2:], "of more than 3 scans"),
        (BASE[:SCAN] + BASE[FRAME:], "several images in one"),
        (BASE.replace(b"\xff\xc0", b"\xff\xc1"), "neither baseline nor progressive"),
        (BASE.replace(b"\xff\xc0\x00\x11\x08", b"\xff\xc0\x00\x11\x0c"), "not of eight bits"),
        (BASE.replace(b"\x00\x1e\x00\x32", b"\xff\xff\xff\xff"), "of 65535 x 65535 pixels; 16777216 are"),
        (BASE.replace(b"\x00\x1e\x00\x32", b"\x10\x00\x10\x01"), "of 4097 x 4096 pixels; 16777216 are"),
        (BASE.replace(b"\x00\x1e\x00\x32", b"\x00\x00\x00\x32"), "of no size"),
        (BASE[:2] + BASE[-2:], "empty"),
        (BASE[:2] + b"\xff\x01" * 2000, "of more than 1000 markers"),
        (BASE[:2] + b"\xff" * 100_000, "cut off"),
        (b"\x89PNG\r\n\x1a\n", "not a JPEG"),
        (b"", "not a JPEG"),
    ],
)
def test_what_no_camera_sends_is_refused(data: bytes, message: str) -> None:
    assert refusal(data).startswith(message)


def test_another_size_than_the_camera_s_is_refused() -> None:
    assert refusal(BASE, (320, 240)) == "of 50 x 30 pixels; the camera has 320 x 240"


@given(st.integers(0, len(BASE) - 1), st.binary(max_size=20))
def test_damage_never_raises_anything_else(at: int, patch: bytes) -> None:
    data = BASE[:at] + patch + BASE[at + len(patch) :]
    with suppress(ImageError):
        assert jpeg_structure(data).scans <= 16
