"""Reads one run in a process of its own: `python -m framerunner.monitoring.read_run FOLDER TARGET`.

A lockstep flight is flown again, which keeps a processor busy for seconds; the monitor and what it watches
must not feel that. What is damaged, or larger than memory, ends this process and no other.
"""

from __future__ import annotations

import contextlib
import json
import os
import resource
import shutil
import sys
from pathlib import Path

import cv2

from framerunner.flying.child_process import end_with_standard_input
from framerunner.monitoring.run_json import FlownMission, flight_json
from framerunner.recording.collected import CollectedFlight, ImageFile, collect
from framerunner.recording.events import RecordingError
from framerunner.recording.open_recording import recorded_flight
from offboard.mission import MissionError, load_mission
from scenarios.loader import load_scenario
from scenarios.models import Scenario, ScenarioError

RECORDING = "recording.json"
IMAGES = "images"
SPANS = "spans.json"
LONGEST_READ_S = 180
"""Of processor time; a flight of three minutes is flown again in some seconds."""
MEMORY_BYTES = 1 << 30
"""Beyond the libraries'. A recording of an hour takes less than a third of it."""
_NICENESS = 10
_MEGABYTE = 1_000_000


def read_run(folder: Path, target: Path) -> None:
    """Write a run as the monitor wants it.

    Args:
        folder: of the run.
        target: folder to which `recording.json`, the images one behind the other, and their places are
            written.

    Raises:
        RecordingError: there is nothing to show, or it is damaged.
    """
    scenario, mission = _scenario(folder), _mission(folder)
    with (target / IMAGES).open("w+b") as file:
        with recorded_flight(folder) as recorded:
            flight = collect(recorded, ImageFile(file))
        size_px = _image_size(flight, scenario)
        recording = flight_json(folder.name, flight, scenario, mission, size_px)
        (target / SPANS).write_text(json.dumps(flight.images.spans), encoding="utf-8")
        text = json.dumps(recording, allow_nan=False, separators=(",", ":"))
        (target / RECORDING).write_text(text, encoding="utf-8")


def _scenario(folder: Path) -> Scenario | None:
    path = folder / "scenario.yaml"
    return load_scenario(path) if path.is_file() else None


def _mission(folder: Path) -> FlownMission | None:
    """The run's mission; None if there is none that loads without running Python."""
    path = folder / "mission.yaml"
    try:
        source = path.read_text(encoding="utf-8")
        return FlownMission(load_mission(path), source) if len(source) < _MEGABYTE else None
    except (OSError, ValueError, MissionError):
        return None


def _image_size(flight: CollectedFlight, scenario: Scenario | None) -> tuple[int, int]:
    if len(flight.images):
        height, width = flight.images.image(0).shape[:2]
        return width, height
    return (320, 240) if scenario is None else (scenario.camera.width_px, scenario.camera.height_px)


def main() -> int:
    """Read the run that the command line names; what goes wrong is the last line on standard error."""
    folder, target = Path(sys.argv[1]), Path(sys.argv[2])
    end_with_standard_input(lambda: shutil.rmtree(target, ignore_errors=True))
    with contextlib.suppress(OSError):
        os.nice(_NICENESS)
    cv2.setNumThreads(1)  # each has a stack, and the flight that is watched wants the processors
    limit_resources(MEMORY_BYTES, LONGEST_READ_S)
    try:
        os.chdir(folder.parent)  # so that no message tells strangers where the runs lie
        read_run(Path(folder.name), target)
    except MemoryError:
        print(f"it needs more than {MEMORY_BYTES >> 20} MB of memory; it must be damaged", file=sys.stderr)
        return 2
    except (RecordingError, ScenarioError, OSError) as error:
        print(" ".join(str(error).split()), file=sys.stderr)
        return 2
    return 0


def limit_resources(memory_bytes: int, processor_s: int) -> None:
    """Have this process fail with MemoryError, or be killed, when it takes more than this.

    Args:
        memory_bytes: that it may take from now on.
        processor_s: of processor time in all.
    """
    with open("/proc/self/statm", encoding="ascii") as file:
        held_bytes = int(file.read().split()[5]) * resource.getpagesize()  # data and stacks
    for what, limit in (
        (resource.RLIMIT_DATA, held_bytes + memory_bytes),
        (resource.RLIMIT_CPU, processor_s),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(what)[1]
        wanted = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
        resource.setrlimit(what, (wanted, wanted))


if __name__ == "__main__":
    sys.exit(main())
