import cv2
import numpy as np
import pytest

from sitl.picture_album import PictureAlbum
from sitl.storage import MemoryStorage, StorageLimits
from sitl.storage_folder import FolderStorage

BOOT_US = 1_795_000_000_000_000  # 2026-11-18 11:06:40 UTC
FOLDER = ("DCIM", "20261118_110640")
IMAGE = np.full((24, 32, 3), (10, 20, 200), np.uint8)


@pytest.fixture(params=["memory", "folder"])
def storage(request, tmp_path):
    return MemoryStorage() if request.param == "memory" else FolderStorage(tmp_path)


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


def test_a_full_storage_keeps_nothing_and_no_half_picture():
    storage = MemoryStorage(StorageLimits(total_bytes=100))
    album = PictureAlbum(storage, BOOT_US)
    album.show(IMAGE)
    assert album.capture(0, 0) == ""
    assert storage.entries(FOLDER) == []
