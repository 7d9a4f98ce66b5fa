import os

import pytest

from framerunner.commands.sim import _read_key
from framerunner.errors import SettingError
from framerunner.files.text_file import TextError, append_in_folder, decode_text, read_text, replace_file
from framerunner.mocap.poses import Axes, parse_line, read_poses
from framerunner.preflight.kept import load_kept
from offboard.mission import load_mission
from offboard.pilot_file import read_pilot
from scenarios.loader import load_scenario
from tests.disk import disk_that_takes

MARK = b"\xef\xbb\xbf"


@pytest.mark.parametrize("data", [b"a\nb\n", MARK + b"a\nb\n", b"a\r\nb\r\n", MARK + b"a\rb\r"])
def test_marks_and_line_ends_are_no_content(data):
    assert decode_text(data) == "a\nb\n"


@pytest.mark.parametrize(
    ("data", "fault", "line"),
    [
        ("a: 1".encode("utf-16"), "utf16", 0),
        ("a: 1".encode("utf-16-be"), "utf16", 0),
        ("a".encode("utf-32"), "utf16", 0),
        (b"a\nb\xe9\n", "not_utf8", 2),
        (b"12345678901", "too_large", 0),
    ],
)
def test_what_is_no_text_is_refused(tmp_path, data, fault, line):
    path = tmp_path / "text"
    path.write_bytes(data)
    with pytest.raises(TextError) as caught:
        read_text(path, 10)
    assert (caught.value.fault, caught.value.line) == (fault, line)


@pytest.mark.parametrize("path", ["none", ".", "a\0b"])
def test_what_cannot_be_read_is_refused(tmp_path, monkeypatch, path):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(TextError, match="cannot be read") as caught:
        read_text(path)
    assert caught.value.fault == ("missing" if path == "none" else "unreadable")


TEXTS = {
    "a.yaml": "name: a\ninitial: rise\nstates:\n  rise:\n    final: true\n",
    "scenario.yaml": "name: a\n",
    "pilot.py": "from offboard.pilot import Pilot\n\n\nclass Mine(Pilot):\n    careful_m_s = 0.2\n",
    "poses.csv": "time_s, x, y, z, qw, qx, qy, qz\n0, 0, 0, 1, 1, 0, 0, 0\n0.1, 0, 0, 1, 1, 0, 0, 0\n",
    "poses.jsonl": '{"time_s": 0, "x": 0, "y": 0, "z": 1, "qw": 1, "qx": 0, "qy": 0, "qz": 0}\n',
    "key.txt": "correct horse\n",
    "old.params": "# vehicle-uid\tabc\n1\t1\tCOM_OBL_RC_ACT\t4\t6\n",
}
READERS = {
    "a.yaml": lambda path: load_mission(path).spec,
    "scenario.yaml": load_scenario,
    "pilot.py": lambda path: read_pilot(path).text,
    "poses.csv": lambda path: read_poses(path, Axes.FLU, None),
    "poses.jsonl": lambda path: read_poses(path, Axes.FLU, None),
    "key.txt": lambda path: _read_key(path).secret,
    "old.params": load_kept,
}


@pytest.mark.parametrize("name", TEXTS)
def test_texts_of_windows_editors_mean_the_same(tmp_path, name):
    path, read = tmp_path / name, READERS[name]
    path.write_text(TEXTS[name], encoding="utf-8")
    plain = read(path)
    path.write_bytes(MARK + TEXTS[name].replace("\n", "\r\n").encode())
    assert read(path) == plain
    path.write_text(TEXTS[name], encoding="utf-16")
    with pytest.raises(Exception, match="is UTF-16 text, or no text; save it as UTF-8"):
        read(path)


@pytest.mark.parametrize("line", ["2\t1\tCOM_OBL_RC_ACT\t5\t6", "1\t100\tCAM_MODE\t1\t6"])
def test_parameters_of_several_vehicles_or_of_a_camera_are_not_returned_to_one(tmp_path, line):
    path = tmp_path / "old.params"
    path.write_text(TEXTS["old.params"] + line + "\n")
    with pytest.raises(SettingError, match="use a copy with those of one vehicle's autopilot, component 1"):
        load_kept(path)


def test_a_pose_that_is_sent_may_begin_with_a_mark():
    line = TEXTS["poses.jsonl"].encode()
    assert parse_line(MARK + line) == parse_line(line)


def test_a_file_is_replaced_as_a_whole_and_keeps_its_mode_and_link(tmp_path):
    path, link = tmp_path / "a.txt", tmp_path / "link"
    path.write_text("old")
    path.chmod(0o640)
    link.symlink_to(path)
    replace_file(link, "né\n")
    assert link.is_symlink()
    assert path.read_text(encoding="utf-8") == "né\n"
    assert path.stat().st_mode & 0o777 == 0o640
    with pytest.raises(OSError, match="large"), disk_that_takes(100):
        replace_file(path, "x" * 1000)
    assert path.read_text(encoding="utf-8") == "né\n"
    assert sorted(os.listdir(tmp_path)) == ["a.txt", "link"]


def test_what_is_no_regular_file_is_not_replaced(tmp_path):
    path = tmp_path / "pipe"
    os.mkfifo(path)
    with pytest.raises(OSError, match="not a regular file"):
        replace_file(path, "text")
    assert path.is_fifo()


def test_two_programs_that_write_at_the_same_time_each_replace_all_of_it(tmp_path, monkeypatch):
    path, sync = tmp_path / "a.txt", os.fsync

    def other_program_writes(handle):
        monkeypatch.setattr(os, "fsync", sync)
        replace_file(path, "other")
        assert path.read_text() == "other"
        sync(handle)

    monkeypatch.setattr(os, "fsync", other_program_writes)
    replace_file(path, "own")
    assert path.read_text() == "own"
    assert os.listdir(tmp_path) == ["a.txt"]


def test_a_line_that_a_full_disk_takes_in_part_is_told(tmp_path):
    path = tmp_path / "lines"
    append_in_folder(path, b"first\n")
    with pytest.raises(OSError, match="No space left"), disk_that_takes(10):
        append_in_folder(path, b"second\n")
    append_in_folder(path, b"third\n")
    assert path.read_bytes() == b"first\nseco\nthird\n"
