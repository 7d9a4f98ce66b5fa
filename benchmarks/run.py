"""Runs programs in processes of their own and collects what they print."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import atan, tan
from pathlib import Path
from typing import Any

from benchmarks.compare import (
    BadResultError,
    Comparison,
    Pair,
    best,
    check_flight,
    goals_along,
    last_object,
    least,
    read_flight,
)
from benchmarks.contenders import Contender
from benchmarks.one_core import SINGLE_THREADS
from benchmarks.peers.environment import PeerMissingError, ensure
from benchmarks.peers.job import EXIT_CANNOT_FLY, Box, Flight, Job
from scenarios.models import Scenario
from sitl.solids import base_solid, frame_solids

ROOT = Path(__file__).parents[1]
LIMIT_S = 900.0
OURS = "benchmarks.peers.ours_flight"
_RGB = {
    "red": (1.0, 0.0, 0.0),
    "green": (0.0, 1.0, 0.0),
    "blue": (0.0, 0.0, 1.0),
    "base": (0.6, 0.6, 0.6),
}

Say = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Results:
    """What was measured.

    Attributes:
        ours: our cheapest flight of all.
        comparisons: with the contenders that could be measured.
        failed: contender's key to the reason, for the others.
    """

    ours: Flight
    comparisons: tuple[Comparison, ...]
    failed: dict[str, str]


def job_for(scenario: Scenario, name: str, seconds: float, image_rate_hz: float) -> Job:
    """The job without goals, which our own flight gives."""
    camera = scenario.camera
    solids = [base_solid(scenario), *(solid for frame in scenario.frames for solid in frame_solids(frame))]
    return Job(
        variant="",
        scenario=name,
        seconds=seconds,
        image_rate_hz=image_rate_hz,
        width_px=camera.width_px,
        height_px=camera.height_px,
        vertical_fov_rad=2 * atan(tan(camera.horizontal_fov_rad / 2) * camera.height_px / camera.width_px),
        camera_flu_m=camera.position_flu_m,
        arena_m=(scenario.arena.length_x_m, scenario.arena.width_y_m),
        sun_direction=scenario.light.sun_direction_arena,
        boxes=tuple(
            Box(solid.centre_arena_m, solid.half_extents_m, solid.yaw_rad, _RGB[solid.name])
            for solid in solids
        ),
    )


def measure_parts(scenario: str, repeats: int, say: Say) -> dict[str, Any]:
    """What the parts of a flight of ours cost, the least of several runs; see `benchmarks/lockstep.py`."""
    command = [sys.executable, "-m", "benchmarks.lockstep", scenario, "--json"]
    runs = []
    for number in range(1, repeats + 1):
        say(f"the parts of our flight, {number} of {repeats}")
        runs.append(last_object(run_program(command, "")))
    return least(runs)


def compare_all(
    job: Job, contenders: tuple[Contender, ...], repeats: int, say: Say, pictures: Path | None = None
) -> Results:
    """Fly ours and each contender's in turn, so that a change of the machine's speed meets both.

    Args:
        job: without goals.
        contenders: which.
        repeats: how many pairs of each.
        say: told what goes on.
        pictures: folder for the last image of each.

    Raises:
        BadResultError: our own flight cannot be measured.
    """
    say("our flight")
    first = _fly(sys.executable, OURS, _with_image(job, pictures, "ours"))
    check_flight(first, job)
    job = replace(job, goals=goals_along(first.path))
    interpreters, failed = _install(contenders, say)
    flights = [first]
    pairs: dict[Contender, list[Pair]] = {each: [] for each in contenders if each.key not in failed}
    for round_number in range(1, repeats + 1):
        for contender in [each for each in pairs if each.key not in failed]:
            say(f"round {round_number} of {repeats}: ours, then {contender.name}, {contender.settings}")
            ours = _fly(sys.executable, OURS, job)
            flights.append(ours)
            peer_job = replace(_with_image(job, pictures, contender.key), variant=contender.variant)
            try:
                peer = _fly(str(interpreters[contender.peer]), contender.module, peer_job)
                check_flight(peer, job)
            except BadResultError as error:
                failed[contender.key] = str(error)
                continue
            pairs[contender].append(Pair(ours, peer))
    comparisons = [Comparison(each, tuple(found)) for each, found in pairs.items() if each.key not in failed]
    return Results(best(flights), tuple(comparisons), failed)


def _install(contenders: tuple[Contender, ...], say: Say) -> tuple[dict[str, Path], dict[str, str]]:
    """Interpreters by peer, and reasons by contender where there is none."""
    interpreters: dict[str, Path] = {}
    failed: dict[str, str] = {}
    for peer in dict.fromkeys(each.peer for each in contenders):
        try:
            interpreters[peer] = ensure(peer, ROOT, say)
        except PeerMissingError as error:
            failed |= {each.key: str(error) for each in contenders if each.peer == peer}
    return interpreters, failed


def _with_image(job: Job, pictures: Path | None, key: str) -> Job:
    return job if pictures is None else replace(job, image_file=str(pictures.resolve() / f"{key}.npy"))


def _fly(interpreter: str, module: str, job: Job) -> Flight:
    return read_flight(run_program([interpreter, "-m", module], job.to_json()))


def run_program(command: list[str], text: str) -> str:
    """Run a program to its end.

    Raises:
        BadResultError: it fails or takes too long; with the last line of what it complains of.
    """
    try:
        done = subprocess.run(
            command,
            input=text,
            capture_output=True,
            text=True,
            errors="replace",
            cwd=ROOT,
            env=os.environ | SINGLE_THREADS,
            timeout=LIMIT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise BadResultError(f"not done within {LIMIT_S:g} s") from None
    if done.returncode != 0:
        complaints = done.stderr.strip().splitlines() or [f"ended with code {done.returncode}"]
        known = done.returncode == EXIT_CANNOT_FLY
        raise BadResultError(complaints[-1] if known else f"failed: {complaints[-1]}")
    return done.stdout
