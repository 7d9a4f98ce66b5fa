import io
import time

import av
import cv2
import numpy as np
import pytest

from sitl.payload.album import CameraAlbum
from sitl.storage import FolderStorage, StorageLimits, TemporaryStorage

BOOT_US = 1_795_000_000_000_000  # 2026-11-18 11:06:40 UTC
FOLDER = ("DCIM", "20261118_110640")
IMAGE = np.full((24, 32, 3), (10, 20, 200), np.uint8)


@pytest.fixture(params=["temporary", "folder"])
def storage(request, tmp_path):
    return TemporaryStorage() if request.param == "temporary" else FolderStorage(tmp_path)


def test_there_is_no_picture_before_the_first_image(storage):
    assert CameraAlbum(storage, BOOT_US, 10.0).capture(0, 0) is None
    assert storage.entries(()) == []


def test_pictures_are_the_newest_image_under_their_address(storage):
    album = CameraAlbum(storage, BOOT_US, 10.0)
    for index in range(2):
        album.show(IMAGE, 0)
        url = album.capture(1000 * index, index)
        assert url == f"mftp://[;comp=1]DCIM/{FOLDER[1]}/IMG_0000{index}.jpg"
    entry = storage.entry((*FOLDER, "IMG_00001.jpg"))
    picture = cv2.imdecode(np.frombuffer(storage.read((*FOLDER, entry.name), 0, entry.size), np.uint8), 1)
    assert np.abs(picture.astype(int) - IMAGE).max() <= 4
    assert [each.name for each in storage.entries(FOLDER)] == ["IMG_00000.jpg", "IMG_00001.jpg"]


def test_space_is_the_storages(storage):
    album = CameraAlbum(storage, BOOT_US, 10.0)
    before = album.space()
    album.show(IMAGE, 0)
    album.capture(0, 0)
    after = album.space()
    size = storage.entry((*FOLDER, "IMG_00000.jpg")).size
    assert after.total_mib == before.total_mib > 100
    assert (after.used_mib - before.used_mib) * 2**20 == pytest.approx(size)


def test_a_full_storage_keeps_no_picture_and_no_part_of_one():
    storage = TemporaryStorage(StorageLimits(total_bytes=100))
    album = CameraAlbum(storage, BOOT_US, 10.0)
    album.show(IMAGE, 0)
    assert album.capture(0, 0) == ""
    assert storage.entries(FOLDER) == []


def played(storage, name):
    """Times in seconds and mean colours of a recording's images."""
    path = (*FOLDER, name)
    data = storage.read(path, 0, storage.entry(path).size)
    with av.open(io.BytesIO(data)) as container:
        return [
            (round(float(frame.time), 3), frame.to_ndarray(format="bgr24").mean(axis=(0, 1)))
            for frame in container.decode(video=0)
        ]


def test_a_recording_has_the_images_with_their_vehicle_times(storage):
    album = CameraAlbum(storage, BOOT_US, 10.0)
    assert not album.start_video(0)  # there is no image yet
    album.show(IMAGE, 0)
    assert album.start_video(0)
    assert album.is_recording
    for number in range(6):
        album.show(np.full_like(IMAGE, 40 * number), 1_000_000 + 100_000 * number)
    album.stop_video()
    assert not album.is_recording
    for _ in range(500):
        album.show(IMAGE, 2_000_000)  # completes the file without waiting for it
        if not album._ending:
            break
        time.sleep(0.01)
    frames = played(storage, "VID_00000.mp4")
    assert [time_s for time_s, _ in frames] == [0.0, 0.1, 0.2, 0.3, 0.4, 0.5]
    for number, (_, colour) in enumerate(frames):
        assert colour == pytest.approx([40 * number] * 3, abs=6)


def test_a_recording_ends_when_the_storage_is_full():
    storage = TemporaryStorage(StorageLimits(total_bytes=1_100_000))
    album = CameraAlbum(storage, BOOT_US, 10.0)
    noise = np.random.default_rng(1).integers(0, 256, (5, 240, 320, 3), np.uint8)
    album.show(noise[0], 0)
    assert album.start_video(0)
    for number in range(400):
        album.show(noise[number % 5], 100_000 * number)
        if not album.is_recording:
            break
        time.sleep(0.01)  # as much as the encoder needs
    assert not album.is_recording
    album.close()
    assert len(played(storage, "VID_00000.mp4")) > 1
    assert not album.start_video(1)  # no room


def test_formatting_deletes_what_the_camera_made_and_nothing_else(storage):
    storage.make_folder(("log",))
    storage.create(("log", "flight.ulg"))
    album = CameraAlbum(storage, BOOT_US, 10.0)
    assert album.format()  # nothing is there yet
    album.show(IMAGE, 0)
    album.capture(0, 0)
    assert album.start_video(0)
    assert album.format()
    assert not album.is_recording
    assert [entry.name for entry in storage.entries(())] == ["log"]
    assert storage.entry(("log", "flight.ulg")).size == 0
