from datetime import UTC, datetime

import cv2
import numpy as np
import pytest

from sitl.drone_files import PictureAlbum, flight_recorder
from sitl.storage import FolderStorage, MemoryStorage, StorageLimits

BOOT_US = 1_795_000_000_000_000  # 2026-11-18 11:06:40 UTC
FOLDER = ("DCIM", "20261118_110640")
IMAGE = np.full((24, 32, 3), (10, 20, 200), np.uint8)


@pytest.fixture(params=["memory", "folder"])
def storage(request, tmp_path):
    return MemoryStorage() if request.param == "memory" else FolderStorage(tmp_path)


def test_a_log_is_named_by_the_time_of_day():
    boot_us = int(datetime(2026, 11, 20, 14, 5, 50, tzinfo=UTC).timestamp() * 1e6)
    recorder = flight_recorder(MemoryStorage(), boot_us)
    assert recorder._name_log(9_500_000) == ("log", "2026-11-20", "14_05_59.ulg")


def test_there_is_no_picture_before_the_first_image(storage):
    assert PictureAlbum(storage, BOOT_US).capture(0, 0) is None
    assert storage.entries(()) == []


def test_pictures_are_the_newest_image_under_their_address(storage):
    album = PictureAlbum(storage, BOOT_US)
    for index in range(2):
        album.show(IMAGE)
        url = album.capture(1000 * index, index)
        assert url == f"mftp://[;comp=1]DCIM/{FOLDER[1]}/IMG_0000{index}.jpg"
    entry = storage.entry((*FOLDER, "IMG_00001.jpg"))
    picture = cv2.imdecode(np.frombuffer(storage.read((*FOLDER, entry.name), 0, entry.size), np.uint8), 1)
    assert np.abs(picture.astype(int) - IMAGE).max() <= 4
    assert [each.name for each in storage.entries(FOLDER)] == ["IMG_00000.jpg", "IMG_00001.jpg"]


def test_space_is_the_storages(storage):
    album = PictureAlbum(storage, BOOT_US)
    before = album.space()
    album.show(IMAGE)
    album.capture(0, 0)
    after = album.space()
    size = storage.entry((*FOLDER, "IMG_00000.jpg")).size
    assert after.total_mib == before.total_mib > 100
    assert (after.used_mib - before.used_mib) * 2**20 == pytest.approx(size)


def test_a_full_storage_keeps_no_picture_and_no_part_of_one():
    storage = MemoryStorage(StorageLimits(total_bytes=100))
    album = PictureAlbum(storage, BOOT_US)
    album.show(IMAGE)
    assert album.capture(0, 0) == ""
    assert storage.entries(FOLDER) == []
