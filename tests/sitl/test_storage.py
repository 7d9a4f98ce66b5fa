"""A storage keeps its limits, and its folder cannot be left."""

import errno
import os
from contextlib import closing, suppress
from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_py.storage import StorageEntry, parse_path
from sitl.storage import FolderStorage, StorageFolderError, StorageLimits, TemporaryStorage, open_storage
from tests.disk import disk_that_takes

LIMITS = StorageLimits(files=6, file_bytes=1000, total_bytes=1500)


@pytest.fixture(params=["temporary", "folder"])
def storage(request, tmp_path):
    if request.param == "temporary":
        yield TemporaryStorage(LIMITS)
        return
    folder = FolderStorage(tmp_path / "files", LIMITS)
    yield folder
    folder.close()


def number(call, *args):
    """The errno with which a call fails; 0: it does not."""
    try:
        call(*args)
    except OSError as error:
        return error.errno
    return 0


def every_call(storage, path, other, data):
    """All methods of a storage, at one path."""
    return (
        (storage.entry, path),
        (storage.entries, path),
        (storage.read, path, 0, 10),
        (storage.write, path, 0, data),
        (storage.truncate, path, 0),
        (storage.create, path),
        (storage.remove, path),
        (storage.remove_folder, path),
        (storage.rename, path, other),
    )


def test_files_are_written_read_grown_cut_renamed_and_removed(storage):
    storage.create(("a",))
    storage.write(("a",), 0, b"abc")
    storage.write(("a",), 5, b"f")
    assert storage.read(("a",), 0, 100) == b"abc\0\0f"
    assert storage.read(("a",), 4, 1) == b"\0"
    assert storage.read(("a",), 50, 1) == b""
    storage.truncate(("a",), 2)
    assert storage.entry(("a",)).size == 2
    storage.make_folder(("folder",))
    storage.create(("folder", "b"))
    storage.rename(("a",), ("folder", "b"))
    assert storage.read(("folder", "b"), 0, 9) == b"ab"
    storage.rename(("folder",), ("moved",))
    assert [entry.name for entry in storage.entries(("moved",))] == ["b"]
    storage.create(("moved", "b"))
    assert storage.entry(("moved", "b")).size == 0
    storage.remove(("moved", "b"))
    storage.remove_folder(("moved",))
    assert storage.entries(()) == []


def test_times_and_kinds(storage):
    storage.make_folder(("folder",))
    storage.create(("file",))
    file, folder = storage.entries(())
    assert (file.name, file.is_folder, folder.name, folder.is_folder) == ("file", False, "folder", True)
    assert abs(file.modified_unix_s - datetime.now(UTC).timestamp()) < 5
    assert storage.entry(()) == StorageEntry("", 0, True)


def test_errors_have_numbers(storage):
    storage.create(("a",))
    storage.make_folder(("folder",))
    storage.create(("folder", "b"))
    assert number(storage.entry, ("no",)) == errno.ENOENT
    assert number(storage.read, ("no",), 0, 1) == errno.ENOENT
    assert number(storage.write, ("no",), 0, b"x") == errno.ENOENT
    assert number(storage.create, ("no", "b")) == errno.ENOENT
    assert number(storage.entries, ("a",)) == errno.ENOTDIR
    assert number(storage.remove, ("folder",)) == errno.EISDIR
    assert number(storage.create, ("folder",)) == errno.EISDIR
    assert number(storage.make_folder, ("a",)) == errno.EEXIST
    assert number(storage.remove_folder, ("folder",)) == errno.ENOTEMPTY
    assert number(storage.rename, ("folder",), ("folder", "inside")) == errno.EINVAL
    assert number(storage.rename, ("no",), ("new",)) == errno.ENOENT
    assert number(storage.rename, ("folder",), ("a",)) == errno.EEXIST


def test_what_the_disk_refused_is_an_error_and_does_not_count(tmp_path):
    with closing(FolderStorage(tmp_path, LIMITS)) as storage:
        storage.create(("a",))
        with disk_that_takes(100):
            for _ in range(3):
                assert number(storage.write, ("a",), 0, bytes(700)) == errno.EFBIG
                assert storage.space()[0] == storage.entry(("a",)).size == 100
            for _ in range(3):
                assert number(storage.truncate, ("a",), 900) == errno.EFBIG
        assert storage.space()[0] == 100
        storage.write(("a",), 0, bytes(1000))
        assert storage.space()[0] == 1000


def test_limits_of_size_sum_and_count(storage):
    storage.create(("a",))
    assert number(storage.write, ("a",), 0, bytes(1001)) == errno.EFBIG
    assert number(storage.write, ("a",), 1 << 31, b"x") == errno.EFBIG
    assert number(storage.truncate, ("a",), 1001) == errno.EFBIG
    storage.truncate(("a",), 1000)
    storage.create(("b",))
    assert number(storage.write, ("b",), 0, bytes(501)) == errno.ENOSPC
    storage.write(("b",), 0, bytes(500))
    assert number(storage.write, ("b",), 500, b"x") == errno.ENOSPC
    storage.remove(("a",))
    storage.write(("b",), 500, b"x")
    for name in "cdefg":
        storage.create((name,))
    assert number(storage.create, ("h",)) == errno.ENOSPC
    assert number(storage.make_folder, ("h",)) == errno.ENOSPC
    storage.remove(("c",))
    storage.create(("h",))


def test_what_is_in_the_folder_already_counts(tmp_path):
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "a").write_bytes(bytes(1400))
    storage = FolderStorage(tmp_path, LIMITS)
    storage.create(("b",))
    assert number(storage.write, ("b",), 0, bytes(101)) == errno.ENOSPC
    storage.write(("b",), 0, bytes(100))


def test_symbolic_links_lead_nowhere(tmp_path):
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "secret").write_text("secret")
    inside = tmp_path / "inside"
    inside.mkdir()
    (inside / "folder").symlink_to(outside)
    (inside / "file").symlink_to(outside / "secret")
    (inside / "dangling").symlink_to(outside / "new")
    os.mkfifo(inside / "pipe")
    storage = FolderStorage(inside)
    assert storage.entries(()) == []
    for path in (("file",), ("folder", "secret"), ("folder",), ("dangling",), ("pipe",)):
        for call, *args in every_call(storage, path, ("stolen",), b"x"):
            assert number(call, *args), call
    assert number(storage.make_folder, ("folder", "new"))
    assert (outside / "secret").read_text() == "secret"
    assert [path.name for path in outside.iterdir()] == ["secret"]


@pytest.mark.parametrize(
    "text", [b"..", b"/a/../b", b"../../etc/passwd", b"a\nb", b"\xff\xfe", b"a\\..\\b", b"n" * 121, b"a/" * 9]
)
def test_paths_that_are_refused(text):
    assert number(parse_path, text) == errno.EACCES


def test_paths_begin_at_the_root_whatever_they_look_like():
    assert parse_path(b"/") == parse_path(b"") == parse_path(b"./.") == ()
    assert parse_path(b"//a/./b/") == ("a", "b")
    assert parse_path(b"/fs/microsd/log") == ("log",)
    assert parse_path("/é/..hidden".encode()) == ("é", "..hidden")


@given(st.binary(max_size=239))
def test_any_bytes_are_a_path_inside_or_refused(text):
    try:
        path = parse_path(text)
    except OSError:
        return
    for name in path:
        assert name not in ("", ".", "..")
        assert not set(name) & set("/\\\0\n\t")


@given(st.lists(st.tuples(st.integers(0, 9), st.binary(max_size=30), st.binary(max_size=30)), max_size=30))
def test_nothing_outside_the_folder_is_touched(tmp_path_factory, steps):
    top = tmp_path_factory.mktemp("top")
    (top / "beside").write_text("untouched")
    storage = FolderStorage(top / "files", LIMITS)
    for step, first, second in steps:
        with suppress(OSError):
            old, new = parse_path(first), parse_path(second)
            call, *args = (*every_call(storage, old, new, second), (storage.make_folder, old))[step]
            call(*args)
    storage.close()
    assert sorted(path.name for path in top.iterdir()) == ["beside", "files"]
    assert (top / "beside").read_text() == "untouched"


def test_a_folder_that_cannot_be_used_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageFolderError, match="file/0: cannot be used for the drone's files"):
        open_storage(tmp_path / "file", 0)


def test_each_instance_has_its_own_folder(tmp_path):
    open_storage(tmp_path, 3).create(("a",))
    assert (tmp_path / "3" / "a").exists()
    assert isinstance(open_storage(None, 0), TemporaryStorage)
