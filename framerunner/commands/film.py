"""`framerunner film`: a short film of a flight."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

from framerunner.commands import check_range, within
from framerunner.errors import SettingError


def film(
    flight: Path,
    *,
    out: Path | None = None,
    speed: Annotated[float | None, within(0.1, 200.0)] = None,
    seconds: Annotated[float | None, within(3.0, 600.0)] = None,
    size: str | None = None,
    fps: float | None = None,
    force: bool = False,
    pilot: str | None = None,
) -> int:
    """Make a short film of a flight: the arena, the camera's image, the mission's state, times and verdict.

    Shows what `framerunner replay` shows: recordings, lockstep flights (flown again), log and video of
    flights in real time.

    **Examples**

        framerunner film runs/20260101-120000-test-case-1

        framerunner film runs/20260101-120000-test-case-1 --out short.gif --seconds 9

        framerunner film runs/20260101-120000-test-case-1 --speed 4 --size 720x1280

    Args:
        flight: run folder, as `framerunner fly` left it
        out: file to write, .mp4 or .gif; `film.mp4` in the run folder if not given
        speed: seconds of the flight in a second of the film; 8 if not given
        seconds: length of the film in s, 3 to 600, from which the speed follows
        size: width and height in pixels; 960x540, of a GIF 640x360 if not given
        fps: images a second; 25, of a GIF 10 if not given
        force: replace a film that is there
        pilot: of a mission that has to be flown again and needs one: a Python file, or a name
    """
    target = flight / "film.mp4" if out is None else out
    suffix = target.suffix.lower()
    if suffix not in {".mp4", ".gif"}:
        raise SettingError(f"--out {target}: must end in .mp4 or .gif")
    if flight.is_dir() and target.exists() and not force:
        raise SettingError(f"--out {target}: is there already; add --force to replace it, or name another")
    if not target.parent.is_dir() and flight.is_dir():
        raise SettingError(f"--out {target}: its folder does not exist; make it first")
    if speed is not None and seconds is not None:
        raise SettingError("--seconds: chooses the speed itself; leave out --speed or --seconds")
    check_range("--fps", fps, 1.0, 25.0 if suffix == ".gif" else 60.0)
    size_px = _size(size or ("640x360" if suffix == ".gif" else "960x540"))

    from framerunner.film.make_film import FilmSettings, make_film
    from offboard.pilot_file import find_pilot

    source = None if pilot is None else find_pilot(pilot)
    rate = fps or (10.0 if suffix == ".gif" else 25.0)
    made = make_film(flight, FilmSettings(target, size_px, rate, speed or 8.0, seconds), source)
    megabytes = target.stat().st_size / 1e6
    print(f"{target}: {made.seconds:.1f} s, {made.images} images, {megabytes:.1f} MB")
    if made.codec == "mpeg4":
        print("encoded as MPEG-4, which browsers do not play: this FFmpeg has no H.264 encoder (libx264)")
    return 0


def _size(text: str) -> tuple[int, int]:
    """Width and height; even, as video encoders require."""
    found = re.fullmatch(r"(\d{1,5})[x×](\d{1,5})", text)
    if not found:
        raise SettingError(f"--size {text}: must be width and height in pixels, such as 960x540")
    width, height = int(found[1]), int(found[2])
    if not (180 <= min(width, height) <= 2160 and 240 <= max(width, height) <= 3840):
        raise SettingError(f"--size {text}: must be from 240x180 to 3840x2160")
    if width % 2 or height % 2:
        raise SettingError(f"--size {text}: both numbers must be even")
    if not 0.4 <= width / height <= 3.0:
        raise SettingError(f"--size {text}: is too narrow; keep width over height from 0.4 to 3")
    return width, height
