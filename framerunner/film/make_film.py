"""Makes a film of a run folder's flight."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from framerunner.film.film_file import FilmFile, film_file, mp4_codec
from framerunner.film.film_painter import FilmPainter
from framerunner.film.timeline import Timeline
from framerunner.flying.plan import FlightPlan
from framerunner.recording.collected import CollectedFlight, collect
from framerunner.recording.events import RecordingError
from framerunner.recording.open_recording import recorded_flight
from framerunner.runs.run_files import SCENARIO, RunFiles
from offboard.pilot_file import PilotSource
from scenarios.models import Scenario

HOLD_S = 1.5
"""How long the last image, with the verdict, is shown."""
MAX_FILM_S = 600.0
_MIN_MOVING_S = 0.5
_SAMPLES = 24  # images from which a GIF's palette is made


@dataclass(frozen=True, slots=True)
class FilmSettings:
    """What film to make.

    Attributes:
        out: the file; its suffix, .mp4 or .gif, selects the format.
        size_px: width and height, even.
        fps: images a second.
        speed: ratio of flight time to film time.
        seconds: duration of the film; if given, it replaces `speed`.
    """

    out: Path
    size_px: tuple[int, int]
    fps: float
    speed: float
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class FilmSummary:
    """A finished film: number of images, duration and codec."""

    images: int
    seconds: float
    codec: str


def make_film(folder: Path, settings: FilmSettings, pilot: PilotSource | None = None) -> FilmSummary:
    """Make a film of a run folder's flight.

    Args:
        folder: of the flight.
        settings: of the film.
        pilot: a contestant's file, to fly again a mission that needs one.

    Raises:
        RecordingError: there is no flight to show, or it is damaged.
        ScenarioError: its scenario is damaged.
        FilmError: the film cannot be written.
    """
    scenario = _scenario(folder)
    with recorded_flight(folder, pilot) as recorded:
        flight = collect(recorded)
    with flight:
        return _write_film(Timeline(flight, _lifted(scenario, flight)), settings)


def _scenario(folder: Path) -> Scenario:
    if not folder.is_dir():
        raise RecordingError(f"film '{folder}': is no folder; name one that `framerunner fly` left")
    scenario = RunFiles(folder).load_scenario()
    if scenario is None:
        raise RecordingError(f"film '{folder}': holds no {SCENARIO}, so no flight of `framerunner fly`")
    return scenario


def _lifted(scenario: Scenario, flight: CollectedFlight) -> Scenario:
    """The scenario with the gates' heights of this flight."""
    lift_m = 0.0 if flight.result is None else flight.result.lift_m
    return FlightPlan(scenario, lift_m=lift_m).layout if abs(lift_m) < 10.0 else scenario


def _write_film(timeline: Timeline, settings: FilmSettings) -> FilmSummary:
    flown_s = timeline.end_s - timeline.begin_s
    speed = settings.speed
    if settings.seconds is not None:
        speed = flown_s / max(_MIN_MOVING_S, settings.seconds - HOLD_S)
    if flown_s / speed > MAX_FILM_S:
        raise RecordingError(
            f"film: would last {flown_s / speed:.0f} s, longer than {MAX_FILM_S:g} s; raise --speed"
        )
    held = round(HOLD_S * settings.fps)
    moving = max(2, round((flown_s / speed + HOLD_S) * settings.fps) - held)
    times_s = np.linspace(timeline.begin_s, timeline.end_s, moving)
    painter = FilmPainter(timeline, settings.size_px, speed)
    codec = "gif" if settings.out.suffix.lower() == ".gif" else mp4_codec()

    def open_film(path: Path) -> FilmFile:
        if codec == "gif":
            sample_times_s = np.linspace(timeline.begin_s, timeline.end_s, _SAMPLES)
            samples = [painter.paint(float(time_s)) for time_s in sample_times_s]
            samples.append(painter.paint(timeline.end_s, over=True))
            return FilmFile(path, codec, settings.size_px, settings.fps, samples)
        return FilmFile(path, codec, settings.size_px, settings.fps)

    with film_file(settings.out, open_film) as film, _progress() as progress:
        task = progress.add_task(settings.out.name, total=moving + held)
        for time_s in times_s:
            film.add(painter.paint(float(time_s)))
            progress.advance(task)
        last = painter.paint(timeline.end_s, over=True)
        for _ in range(held):
            film.add(last)
            progress.advance(task)
    return FilmSummary(moving + held, (moving + held) / settings.fps, codec)


def _progress() -> Progress:
    """A progress bar in a terminal; nothing elsewhere."""
    console = Console(file=sys.stderr)
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        disable=not console.is_terminal,
    )
