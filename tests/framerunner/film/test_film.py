"""`framerunner film`: complete files that players open, or one line of error and no file."""

import shutil

import av
import numpy as np
import pytest

from framerunner.cli import run
from framerunner.film import film_file as film_file_module
from framerunner.film.film_file import FilmError, FilmFile, film_file
from tests.framerunner.recording.logs import write_log


def frames_of(path):
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        return stream.codec_context.name, [
            frame.to_ndarray(format="rgb24") for frame in container.decode(stream)
        ]


def seconds_of(path):
    with av.open(str(path)) as container:
        return container.duration / av.time_base


def make(folder, *options):
    return run(["film", str(folder), *options])


def test_an_mp4_that_browsers_play(recorded_folder, tmp_path, capsys):
    path = tmp_path / "a.mp4"
    assert (
        make(recorded_folder, "--out", str(path), "--size", "480x270", "--fps", "10", "--seconds", "4") == 0
    )
    codec, frames = frames_of(path)
    assert codec == "h264"
    assert len(frames) == 40
    assert frames[0].shape == (270, 480, 3)
    assert seconds_of(path) == pytest.approx(4.0, abs=0.05)
    assert np.abs(frames[0].astype(int) - frames[-1]).mean() > 3.0
    # The verdict is shown for a while: the last images are equal, except for compression.
    assert np.abs(frames[-1].astype(int) - frames[-12]).mean() < 0.5
    with av.open(str(path)) as container:
        assert container.streams.video[0].codec_context.pix_fmt == "yuv420p"
    data = path.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")  # so that it plays before it is completely loaded
    assert capsys.readouterr().out.startswith(f"{path}: 4.0 s, 40 images, ")
    assert [each.name for each in tmp_path.iterdir()] == ["a.mp4"]


def test_a_gif_repeats(recorded_folder, tmp_path):
    path = tmp_path / "a.gif"
    assert make(recorded_folder, "--out", str(path), "--size", "320x180", "--fps", "5", "--seconds", "4") == 0
    codec, frames = frames_of(path)
    assert codec == "gif"
    assert len(frames) == 20
    assert frames[0].shape == (180, 320, 3)
    assert np.abs(frames[0].astype(int) - frames[-1]).mean() > 3.0
    assert b"NETSCAPE2.0\x03\x01\x00\x00" in path.read_bytes()
    assert path.stat().st_size < 400_000


def test_the_default_file_is_in_the_run_folder_and_is_not_overwritten(recorded_folder, tmp_path, capsys):
    folder = tmp_path / "run"
    shutil.copytree(recorded_folder, folder)
    quick = ("--size", "320x180", "--fps", "2", "--speed", "20")
    assert make(folder, *quick) == 0
    before = (folder / "film.mp4").read_bytes()
    written_ns = (folder / "film.mp4").stat().st_mtime_ns
    assert make(folder, *quick) == 2
    assert "is there already; add --force" in capsys.readouterr().err
    assert make(folder, *quick, "--force", "--seconds", "4") == 2
    assert (folder / "film.mp4").read_bytes() == before
    assert make(folder, *quick, "--force") == 0
    assert (folder / "film.mp4").stat().st_mtime_ns > written_ns


def test_a_lockstep_flight_without_result_or_video_can_be_filmed(recorded_folder, tmp_path):
    folder = tmp_path / "run"
    folder.mkdir()
    for name in ("flight.mcap", "scenario.yaml"):
        shutil.copy(recorded_folder / name, folder)
    assert make(folder, "--size", "320x180", "--fps", "2", "--seconds", "3") == 0
    assert len(frames_of(folder / "film.mp4")[1]) == 6


def test_a_flight_that_is_flown_again_is_filmed_to_its_verdict(short_folder, tmp_path):
    path = tmp_path / "a.mp4"
    assert make(short_folder, "--out", str(path), "--size", "320x180", "--fps", "4", "--speed", "4") == 0
    frames = frames_of(path)[1]
    right = frames[-1][130:170, 200:]
    assert (right.astype(int) @ [2, -1, -1] > 150).sum() > 300  # the verdict of a failed try is red
    assert (frames[2][130:170, 250:].astype(int) @ [2, -1, -1] > 150).sum() == 0


def test_a_killed_real_time_flight_is_filmed_from_its_log(short_folder, tmp_path):
    shutil.copy(short_folder / "scenario.yaml", tmp_path)
    (tmp_path / "flight.mcap").write_bytes(b"cut short")
    write_log(tmp_path / "flight.tlog")
    assert make(tmp_path, "--size", "320x180", "--fps", "4", "--seconds", "4") == 0
    first, *_, last = frames_of(tmp_path / "film.mp4")[1]
    assert np.abs(first.astype(int) - last).mean() > 0.5


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--out", "film.avi"], "--out film.avi: must end in .mp4 or .gif"),
        (["--out", "nowhere/film.mp4"], "--out nowhere/film.mp4: its folder does not exist"),
        (["--size", "huge"], "--size huge: must be width and height in pixels, such as 960x540"),
        (["--size", "961x540"], "--size 961x540: both numbers must be even"),
        (["--size", "100x100"], "--size 100x100: must be from 240x180 to 3840x2160"),
        (["--size", "3000x300"], "--size 3000x300: is too narrow"),
        (["--speed", "0"], "--speed 0: must be from 0.1 to 200"),
        (["--speed", "nan"], "--speed nan: must be from 0.1 to 200"),
        (["--fps", "0.1"], "--fps 0.1: must be from 1 to 60"),
        (["--seconds", "1"], "--seconds 1: must be from 3 to 600"),
        (["--seconds", "10", "--speed", "2"], "--seconds: chooses the speed itself"),
    ],
)
def test_bad_options_are_refused_in_one_line(recorded_folder, tmp_path, monkeypatch, capsys, options, words):
    monkeypatch.chdir(tmp_path)
    assert make(recorded_folder, *options) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"error: {words}")
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_folders_without_a_flight_are_refused_in_one_line(recorded_folder, tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    (tmp_path / "plan").mkdir()
    shutil.copy(recorded_folder / "scenario.yaml", tmp_path / "plan")
    (tmp_path / "damaged").mkdir()
    shutil.copy(recorded_folder / "scenario.yaml", tmp_path / "damaged")
    (tmp_path / "damaged" / "flight.mcap").write_bytes((recorded_folder / "flight.mcap").read_bytes()[:-2000])
    for name, words in (
        ("missing", "is no folder"),
        ("empty", "holds no scenario.yaml"),
        ("plan", "holds no flight"),
        ("damaged", "cut short"),
    ):
        assert make(tmp_path / name) == 2
        error = capsys.readouterr().err.strip().splitlines()
        assert len(error) == 1
        assert words in error[0]
        assert not list(tmp_path.glob(f"{name}/*film*"))


def test_an_interrupted_film_leaves_no_file(tmp_path):
    path = tmp_path / "a.mp4"
    path.write_bytes(b"the one before")

    def film_and_interrupt():
        with film_file(path, lambda part: FilmFile(part, "libx264", (320, 180), 10.0)) as film:
            film.add(np.zeros((180, 320, 3), np.uint8))
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        film_and_interrupt()
    assert path.read_bytes() == b"the one before"
    assert list(tmp_path.iterdir()) == [path]


def test_a_folder_that_cannot_be_written_is_refused_in_one_line(recorded_folder, tmp_path):
    with (
        pytest.raises(FilmError, match="cannot write"),
        film_file(tmp_path / "no" / "a.mp4", lambda part: FilmFile(part, "libx264", (320, 180), 10.0)),
    ):
        pass


def test_without_an_h264_encoder_it_is_mpeg4_and_says_so(recorded_folder, tmp_path, monkeypatch, capsys):
    class OldFfmpeg:
        def __init__(self, name, mode):
            raise av.codec.codec.UnknownCodecError(name)

    monkeypatch.setattr(film_file_module, "Codec", OldFfmpeg)
    path = tmp_path / "a.mp4"
    assert make(recorded_folder, "--out", str(path), "--size", "320x180", "--fps", "5", "--seconds", "3") == 0
    codec, frames = frames_of(path)
    assert codec == "mpeg4"
    assert len(frames) == 15
    assert "no H.264 encoder" in capsys.readouterr().out
