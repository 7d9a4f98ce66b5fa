"""Runs each program in a process of its own and reads what it prints.

The peers have an environment of their own (`.venv-bench`), made when it is first needed and used again then.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import atan, tan
from pathlib import Path
from typing import Any

from benchmarks.compare import (
    BadResultError,
    Comparison,
    Contender,
    Pair,
    best,
    check_flight,
    goals_along,
    last_object,
    minima,
    read_flight,
)
from benchmarks.peers.job import EXIT_CANNOT_FLY, SINGLE_THREADS, Box, Flight, Job
from scenarios.models import Scenario
from sitl.solids import gate_solids

ROOT = Path(__file__).parents[1]
LIMIT_S = 900.0
OURS = "benchmarks.peers.ours_flight"
FOLDER = ".venv-bench"
REQUIREMENTS = {"mujoco": "mujoco>=3.3", "pyflyt": "PyFlyt>=0.29"}
_RGB = {
    "red": (1.0, 0.0, 0.0),
    "green": (0.0, 1.0, 0.0),
    "blue": (0.0, 0.0, 1.0),
    "base": (0.6, 0.6, 0.6),
}

_UNREACHABLE = (
    "NewConnectionError",
    "NameResolutionError",
    "ConnectTimeoutError",
    "ProxyError",
    "Temporary failure in name resolution",
    "Network is unreachable",
)

Say = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Results:
    """Our cheapest flight, the comparisons, and why (by contender's key) others could not be measured."""

    ours: Flight
    comparisons: tuple[Comparison, ...]
    failed: dict[str, str]


def job_for(scenario: Scenario, name: str, seconds: float, image_rate_hz: float) -> Job:
    """The job without goals, which our own flight gives."""
    camera = scenario.camera
    solids = [scenario.base.solid, *(solid for gate in scenario.frames for solid in gate_solids(gate))]
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
    """What the parts of our flight cost, the minimum of several runs; see `benchmarks/lockstep.py`."""
    command = [sys.executable, "-m", "benchmarks.lockstep", scenario, "--json"]
    runs = []
    for number in range(1, repeats + 1):
        say(f"the parts of our flight, {number} of {repeats}")
        runs.append(last_object(run_program(command, "")))
    return minima(runs)


def compare_all(
    job: Job, contenders: tuple[Contender, ...], repeats: int, say: Say, pictures: Path | None = None
) -> Results:
    """Fly ours and each contender's in turn, so that a change of the machine's speed affects both.

    Args:
        job: without goals.
        contenders: the peers.
        repeats: pairs of flights with each.
        say: called with lines about the progress.
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
            interpreters[peer] = ensure_peer(peer, ROOT, say)
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
        BadResultError: it fails or takes too long; with the last line of its errors.
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


class PeerMissingError(Exception):
    """A peer cannot be installed here; the message is one line that says why and what to do."""


def ensure_peer(peer: str, root: Path, say: Say) -> Path:
    """Install a peer unless it is installed; return the interpreter that runs it.

    Each peer is installed by itself, so that a failure does not affect the others.

    Args:
        peer: a key of `REQUIREMENTS`.
        root: the folder that holds the environment's folder.
        say: called with lines about the progress.

    Raises:
        PeerMissingError: it cannot be installed.
    """
    folder = root / FOLDER
    interpreter = folder / "bin" / "python"
    stamp = folder / f"installed-{peer}"
    requirement = REQUIREMENTS[peer]
    if interpreter.exists() and stamp.exists() and stamp.read_text(encoding="utf-8") == requirement:
        return interpreter
    if not (folder / "bin" / "pip").exists() or not interpreter.exists():
        _make_environment(folder, say)
    _install_peer(interpreter, requirement, folder / f"pip-{peer}.log", say)
    stamp.write_text(requirement, encoding="utf-8")
    return interpreter


def _make_environment(folder: Path, say: Say) -> None:
    say(f"making {folder.name}")
    code, tail = run_logged([sys.executable, "-m", "venv", str(folder)], folder.parent / "venv.log", say)
    (folder.parent / "venv.log").unlink(missing_ok=True)
    if code != 0:
        words = tail[-1] if tail else f"code {code}"
        raise PeerMissingError(
            f"{folder.name} could not be made ({words}). On Debian and Ubuntu: sudo apt install python3-venv"
        )


def _install_peer(interpreter: Path, requirement: str, log: Path, say: Say) -> None:
    say(f"installing {requirement}")
    options = ["--disable-pip-version-check", "--no-input", "--prefer-binary", "--progress-bar", "off"]
    command = [str(interpreter), "-m", "pip", "install", *options, "--retries", "2", requirement]
    code, tail = run_logged(command, log, say)
    if code != 0:
        raise PeerMissingError(why_not_installed(requirement, tail, log))


def why_not_installed(requirement: str, lines: list[str], log: Path) -> str:
    """Why pip failed, in one line, from the end of its output and the path of its log."""
    place = f"{log.parent.name}/{log.name}"
    if any(mark in line for mark in _UNREACHABLE for line in lines):
        return (
            f"{requirement} could not be installed: no connection to the package index. "
            f"Connect once and run this again; pip's output is in {place}"
        )
    errors = [line for line in lines if line.startswith(("ERROR:", "error:"))]
    last = (errors or lines or ["pip printed nothing"])[-1]
    return f"{requirement} could not be installed: {last.removeprefix('ERROR: ')}; pip's output is in {place}"


def run_logged(command: list[str], log: Path, say: Say) -> tuple[int, list[str]]:
    """Run a command, its output into a log and to `say`; return exit code and last lines of output."""
    tail: deque[str] = deque(maxlen=200)
    with (
        log.open("w", encoding="utf-8") as file,
        subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
        ) as process,
    ):
        assert process.stdout is not None
        try:
            for line in process.stdout:
                file.write(line)
                words = line.strip()
                if words:
                    tail.append(words)
                    say(words)
        except BaseException:
            process.terminate()
            raise
    return process.returncode, list(tail)
