"""Reads one run in a separate process: `python -m framerunner.monitoring.read_run FOLDER TARGET [PILOT]`.

A lockstep flight is flown again, which uses a processor for seconds; the monitor and the flights that it
shows must not be slowed by that. A damaged run, or one larger than memory, ends only this process. The
format is that of `docs/monitor-channels.md`, section 5.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import cos, isfinite, pi, sin
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

from framerunner.child_process import end_with_standard_input, limit_resources
from framerunner.errors import UserError
from framerunner.files.text_file import TextError, read_text
from framerunner.flying.navigation_reporter import map_document
from framerunner.recording.collected import CollectedFlight, ImageFile, collect
from framerunner.recording.open_recording import recorded_flight
from framerunner.runs.run_files import RunFiles
from framerunner.wire.finite_json import finite
from framerunner.wire.mission_report import TransitionTaken
from offboard.app import Moment
from offboard.chart.spec import state_path
from offboard.engine import DONE
from offboard.mission import Mission, MissionError, load_mission, mermaid
from offboard.navigation.view import NavigationView
from offboard.pilot_file import PilotSource, find_pilot
from scenarios.models import COLOURS, Scenario
from vision.types import Detection, Detections

RECORDING = "recording.json"
IMAGES = "images"
SPANS = "spans.json"
MAX_READ_S = 180
"""Processor time; a flight of three minutes is flown again in some seconds."""
MEMORY_BYTES = 1 << 30
"""Beyond the libraries'. A recording of an hour takes less than a third of it."""
_NICENESS = 10
_MEGABYTE = 1_000_000
_MAX_TEXT = 500

Json = dict[str, Any]
Clock = Callable[[int], float]
"""From vehicle time, microseconds, to seconds since motors on."""


def main() -> int:
    """Read the run that the command line names; on failure the last line on standard error is the reason."""
    folder, target = Path(sys.argv[1]), Path(sys.argv[2])
    end_with_standard_input(lambda: shutil.rmtree(target, ignore_errors=True))
    with contextlib.suppress(OSError):
        os.nice(_NICENESS)
    cv2.setNumThreads(1)  # each has a stack, and the flight that is shown live needs the processors
    limit_resources(MEMORY_BYTES, MAX_READ_S)
    try:
        pilot = find_pilot(sys.argv[3]) if len(sys.argv) > 3 else None
        os.chdir(folder.parent)  # so that no message shows the path of the runs
        read_run(Path(folder.name), target, pilot)
    except MemoryError:
        print(f"it needs more than {MEMORY_BYTES >> 20} MB of memory; it must be damaged", file=sys.stderr)
        return 2
    except (UserError, OSError) as error:
        print(" ".join(str(error).split()), file=sys.stderr)
        return 2
    return 0


def read_run(folder: Path, target: Path, pilot: PilotSource | None = None) -> None:
    """Write a run as the monitor's replay reads it.

    Args:
        folder: of the run.
        target: folder for `recording.json`, a file with all images, and their places in it.
        pilot: the one that the monitor was started with; its names may be used.

    Raises:
        RecordingError: there is nothing to show, or it is damaged.
    """
    files = RunFiles(folder)
    scenario = files.load_scenario()
    mission, source = _load_mission(files.mission, pilot)
    with (target / IMAGES).open("w+b") as file:
        with recorded_flight(folder, pilot) as recorded:
            flight = collect(recorded, ImageFile(file))
        recording = _flight_json(folder.name, flight, scenario, mission, source)
        (target / SPANS).write_text(json.dumps(flight.images.spans), encoding="utf-8")
        text = json.dumps(recording, allow_nan=False, separators=(",", ":"))
        (target / RECORDING).write_text(text, encoding="utf-8")


def _load_mission(path: Path, pilot: PilotSource | None) -> tuple[Mission | None, str]:
    """A mission and the text of its file; None if there is none that loads with no other Python file."""
    try:
        return load_mission(path, pilot), read_text(path)
    except (TextError, MissionError):
        return None, ""


def _flight_json(
    name: str, flight: CollectedFlight, scenario: Scenario | None, mission: Mission | None, source: str
) -> Json:
    """All of a flight except its images."""
    result = flight.result
    chart: Json | None = None
    leaves: tuple[str, ...] = ()
    if mission is not None:
        leaves = tuple(mission.leaves)
        chart = {"name": mission.name, "mermaid": mermaid(mission), "states": list(leaves), "source": source}
    # The mission's states, then any others: a log has flight modes instead.
    recorded = (moment.mission_state for moment in flight.moments if moment.mission_state)
    states = list(dict.fromkeys((*leaves, *recorded)))
    numbers = {state: number for number, state in enumerate(states)}

    def clock(time_us: int) -> float:
        return round((time_us - flight.began_us) / 1e6, 3)

    return {
        "name": name,
        "world": {
            "scenario": None if scenario is None else scenario.model_dump(mode="json"),
            "lift_m": 0.0 if result is None else result.lift_m,
            "source": "" if result is None else result.judged_by,
        },
        "chart": chart,
        "states": states,
        "poses": _poses(flight, numbers, clock),
        "detections": _detections(flight.moments, clock, _image_size(flight, scenario)),
        "maps": _maps(flight.moments, clock),
        "transitions": _transitions(flight, clock, mission),
        "images": [clock(time_us) for time_us in flight.images.time_us],
        "crossings": [{"t": clock(each.time_us), "colour": each.colour} for each in flight.crossings],
        "result": None if result is None else result.as_json(),
    }


def _image_size(flight: CollectedFlight, scenario: Scenario | None) -> tuple[int, int]:
    if len(flight.images):
        height, width = flight.images.image(0).shape[:2]
        return width, height
    return (320, 240) if scenario is None else (scenario.camera.width_px, scenario.camera.height_px)


def _poses(flight: CollectedFlight, numbers: Mapping[str, int], clock: Clock) -> list[Json]:
    moments = [moment for moment in flight.moments if _has_pose(moment)]
    true_m = _true_places(flight, moments)
    poses: list[Json] = []
    for number, moment in enumerate(moments):
        before, after = moments[max(0, number - 1)], moments[min(number + 1, len(moments) - 1)]
        span_s = (after.state.time_us - before.state.time_us) / 1e6
        turn_rad = (after.state.yaw - before.state.yaw + pi) % (2 * pi) - pi
        state, command = moment.state, moment.command
        c, s = cos(state.yaw), sin(state.yaw)
        vx, vy, vz = state.velocity_arena_m_s
        sent = _rounded(command.forward_m_s, command.left_m_s, command.up_m_s, command.yaw_rate_rad_s)
        poses.append(
            {
                "t": clock(state.time_us),
                "p": _rounded(state.x, state.y, state.z),
                "truth": None if true_m is None else _rounded(*true_m[number]),
                "q": _rounded(*state.attitude_arena),
                "v": _rounded(c * vx + s * vy, c * vy - s * vx, vz),
                "r": _rounded(turn_rad / span_s if span_s > 0 else 0.0)[0],
                "c": sent if flight.mission_is_known else None,
                "on": state.armed,
                "s": numbers.get(moment.mission_state, -1),
            }
        )
    return poses


def _true_places(flight: CollectedFlight, moments: Sequence[Moment]) -> npt.NDArray[np.float64] | None:
    """Where a simulated drone truly was at some ticks, shape (n, 3); None if that is not known."""
    if not flight.true_path:
        return None
    true_us = [each.time_us for each in flight.true_path]
    at_us = [moment.state.time_us for moment in moments]
    columns = np.array([each.position_m for each in flight.true_path]).T
    return np.column_stack([np.interp(at_us, true_us, column) for column in columns])


def _has_pose(moment: Moment) -> bool:
    state = moment.state
    return all(map(isfinite, (state.x, state.y, state.z, *state.attitude_arena)))


def _detections(moments: Sequence[Moment], clock: Clock, size_px: tuple[int, int]) -> list[Json]:
    found: list[Json] = []
    last: Detections | None = None
    for moment in moments:
        seen = moment.detections
        if seen == last:
            continue
        last = seen
        time_us = moment.state.time_us if seen.time_us is None else seen.time_us
        boxes = {colour: _box(getattr(seen, colour)) for colour in COLOURS}
        at_s = clock(time_us)
        if not found or found[-1]["t"] <= at_s:
            found.append({"t": at_s, "width": size_px[0], "height": size_px[1], "boxes": boxes})
    return found


def _maps(moments: Sequence[Moment], clock: Clock) -> list[Json]:
    """The navigator's map and plan, each time that something of it changed."""
    found: list[Json] = []
    last: NavigationView | None = None
    for moment in moments:
        view = moment.navigation
        if view is not None and view is not last:
            last = view
            content = map_document(view, moment.place).as_json()
            if not found or {**content, "t": found[-1]["t"]} != found[-1]:
                found.append({**content, "t": clock(moment.state.time_us)})
    return found


def _box(detection: Detection) -> list[float | None] | None:
    if not detection.seen:
        return None
    return _rounded(detection.n, detection.s, detection.e, detection.w, detection.d, detection.a)


def _transitions(flight: CollectedFlight, clock: Clock, mission: Mission | None) -> list[Json]:
    """As the engine recorded them or, in older recordings and logs, from the states alone."""
    found: list[Json] = []
    state, since_us = flight.moments[0].mission_state, flight.moments[0].state.time_us
    for moment in flight.moments:
        now_us = moment.state.time_us
        taken = moment.transition
        if taken is None and moment.mission_state == state:
            continue
        if taken is None:
            when = _guard(mission, state, moment.mission_state)
            taken = TransitionTaken(state, moment.mission_state, when, (), now_us, (now_us - since_us) / 1e6)
        taken = replace(taken, ids=taken.ids or _ids(mission, taken))
        found.append({"time_s": clock(now_us), **finite(taken.as_json())})
        state, since_us = moment.mission_state, now_us
    return found


def _guard(mission: Mission | None, source: str, target: str) -> str:
    """The guard between two states, if there is only one in the chart."""
    leaf = None if mission is None else mission.leaves.get(source)
    if leaf is None:
        return ""
    guards = {each.when for each in leaf.transitions if each.to in state_path(target)}
    return guards.pop() if len(guards) == 1 else ""


def _ids(mission: Mission | None, taken: TransitionTaken) -> tuple[str, ...]:
    """Which transition it was, if only one can have been; recordings of older versions do not say."""
    leaf = None if mission is None else mission.leaves.get(taken.source)
    if mission is None or leaf is None:
        return ()
    likely = [each for each in leaf.transitions if taken.when in (each.when, DONE)]
    passages = [mission.table.passage(taken.source, each) for each in likely]
    found = [each.ids for each in passages if each.leaf == taken.target]
    return found[0] if len(found) == 1 else ()


def _rounded(*values: float) -> list[float | None]:
    """To a tenth of a millimetre, which is enough for display; what is not finite is null."""
    return [round(value, 4) if isfinite(value) else None for value in values]


if __name__ == "__main__":
    sys.exit(main())
