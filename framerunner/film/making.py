"""From a run folder to a film."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

from framerunner.film.film_file import FilmFile, GifFile, Mp4File, film_file, mp4_codec
from framerunner.film.sheet import Sheet
from framerunner.film.story import Story
from framerunner.flying.plan import FlightPlan
from framerunner.recording.collected import CollectedFlight, collect
from framerunner.recording.events import RecordingError
from framerunner.recording.open_recording import recorded_flight
from offboard.pilot_file import PilotFile
from scenarios.loader import load_scenario
from scenarios.models import Scenario

HOLD_S = 1.5
"""The last picture, with the verdict, is held for so long."""
LONGEST_S = 600.0
_SHORTEST_S = 1.0
_SAMPLES = 24  # pictures from which a GIF's colours are chosen


@dataclass(frozen=True, slots=True)
class FilmSettings:
    """What film to make.

    Attributes:
        out: the file; its ending, .mp4 or .gif, says the format.
        size_px: width and height, even.
        fps: pictures a second.
        speed: flight time a film time.
        seconds: how long the film is to be, instead of `speed`; None if that holds.
    """

    out: Path
    size_px: tuple[int, int]
    fps: float
    speed: float
    seconds: float | None = None


@dataclass(frozen=True, slots=True)
class Made:
    """A film that is finished.

    Attributes:
        pictures: how many it has.
        seconds: how long it takes.
        codec: what it is encoded with.
    """

    pictures: int
    seconds: float
    codec: str


def make_film(folder: Path, settings: FilmSettings, pilot: PilotFile | None = None) -> Made:
    """Make a film of a run folder's flight.

    Args:
        folder: of the flight.
        settings: what film.
        pilot: a contestant's file, to fly again a mission that needs one.

    Raises:
        RecordingError: there is no flight to show, or it is damaged.
        ScenarioError: its scenario is damaged.
        PlotError: the film cannot be written.
    """
    scenario = _scenario(folder)
    with recorded_flight(folder, pilot) as recorded:
        flight = collect(recorded)
    with flight:
        return _film(Story(flight, _hung(scenario, flight)), settings)


def _scenario(folder: Path) -> Scenario:
    if not folder.is_dir():
        raise RecordingError(f"film '{folder}': is no folder; name one that `framerunner fly` left")
    path = folder / "scenario.yaml"
    if not path.is_file():
        raise RecordingError(f"film '{folder}': holds no scenario.yaml, so no flight of `framerunner fly`")
    return load_scenario(path)


def _hung(scenario: Scenario, flight: CollectedFlight) -> Scenario:
    """The scenario with its frames as high as they were hung for this drone."""
    lift_m = 0.0 if flight.result is None else flight.result.lift_m
    return FlightPlan(scenario, lift_m=lift_m).layout if abs(lift_m) < 10.0 else scenario


def _film(story: Story, settings: FilmSettings) -> Made:
    flown_s = story.end_s - story.begin_s
    speed = settings.speed
    if settings.seconds is not None:
        speed = flown_s / max(_SHORTEST_S / 2, settings.seconds - HOLD_S)
    if flown_s / speed > LONGEST_S:
        raise RecordingError(
            f"film: would take {flown_s / speed:.0f} s, at most {LONGEST_S:g} s are made; raise --speed"
        )
    held = round(HOLD_S * settings.fps)
    moving = max(2, round((flown_s / speed + HOLD_S) * settings.fps) - held)
    times_s = np.linspace(story.begin_s, story.end_s, moving)
    sheet = Sheet(story, settings.size_px, speed)
    codec = "gif" if settings.out.suffix.lower() == ".gif" else mp4_codec()

    def open_film(path: Path) -> FilmFile:
        if codec == "gif":
            chosen = np.linspace(story.begin_s, story.end_s, _SAMPLES)
            samples = [sheet.paint(float(time_s)) for time_s in chosen]
            samples.append(sheet.paint(story.end_s, over=True))
            return GifFile(path, settings.size_px, settings.fps, samples)
        return Mp4File(path, settings.size_px, settings.fps, codec)

    with film_file(settings.out, open_film) as film, _progress() as progress:
        task = progress.add_task(settings.out.name, total=moving + held)
        for time_s in times_s:
            film.add(sheet.paint(float(time_s)))
            progress.advance(task)
        last = sheet.paint(story.end_s, over=True)
        for _ in range(held):
            film.add(last)
            progress.advance(task)
    return Made(moving + held, (moving + held) / settings.fps, codec)


def _progress() -> Progress:
    """A bar in a terminal, nothing elsewhere."""
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
