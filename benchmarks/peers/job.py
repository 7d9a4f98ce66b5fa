"""What the programs of the comparison share: the job they read, the flight they print, and how it is timed.

Both are JSON, on standard input and output. Costs are processor time on one core with one thread, so that
they can be compared between programs. Only the standard library, as this project is not installed in the
peers' environment. Axes are the arena's: x forward, y left, z up, yaw counter-clockwise from x.
"""

from __future__ import annotations

import json
import os
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any

EXIT_CANNOT_FLY = 3
EGL_ADVICE = "On Debian and Ubuntu: sudo apt install libegl1 libgl1-mesa-dri"

Vec3 = tuple[float, float, float]

SINGLE_THREADS = {  # environment variables; libraries read them when they are loaded
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    "LP_NUM_THREADS": "0",  # llvmpipe, Mesa's OpenGL without a graphics card: draw in the calling thread
    "LIBGL_ALWAYS_SOFTWARE": "1",  # the processor draws: a graphics card's work is in no processor time
}


def pin_to_one_core() -> None:
    """Keep this process on one core, where the system can do that."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def processor_time_s() -> float:
    """Processor time of this process, its threads and its ended children, seconds."""
    usages = (resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


@dataclass(slots=True)
class Stopwatch:
    """Processor and wall time since it was made, seconds."""

    _began_s: tuple[float, float] = field(default_factory=lambda: (processor_time_s(), time.perf_counter()))

    def read(self) -> tuple[float, float]:
        """Processor time and wall time so far, seconds."""
        processor_s, wall_s = self._began_s
        return processor_time_s() - processor_s, time.perf_counter() - wall_s


class CannotFlyError(Exception):
    """This program cannot fly the job here; the message is one line that says what is missing."""


@dataclass(frozen=True, slots=True)
class Box:
    """A solid box: centre and half extents (metres), yaw (radians), colour (red, green, blue, 0 to 1)."""

    centre_m: Vec3
    half_m: Vec3
    yaw_rad: float
    rgb: Vec3


@dataclass(frozen=True, slots=True)
class Goal:
    """Where to fly from a time on: seconds since the start, metres, radians."""

    time_s: float
    position_m: Vec3
    yaw_rad: float


@dataclass(frozen=True, slots=True)
class Job:
    """One flight to be timed."""

    variant: str  # key of the program's settings; see `benchmarks.compare`
    scenario: str  # name or file, for our own program
    seconds: float
    image_rate_hz: float  # images a second of flight
    width_px: int = 320
    height_px: int = 240
    vertical_fov_rad: float = 1.29
    camera_flu_m: Vec3 = (0.0, 0.0, 0.0)  # position on the drone; the camera looks forward
    arena_m: tuple[float, float] = (10.0, 10.0)  # extent of the floor along x and y
    sun_direction: Vec3 = (0.0, 0.0, -1.0)  # in which its light travels
    boxes: tuple[Box, ...] = ()  # base and gates
    goals: tuple[Goal, ...] = ()  # in order of time; the first is the start
    image_file: str = ""  # for the last image (NumPy's format); empty: it is not saved

    def to_json(self) -> str:
        """The job on one line."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Job:
        """A job that `to_json` wrote."""
        values = json.loads(text)
        values["boxes"] = tuple(Box(**box) for box in values["boxes"])
        values["goals"] = tuple(Goal(**goal) for goal in values["goals"])
        return cls(**values)


@dataclass(frozen=True, slots=True)
class Flight:
    """What a flight cost."""

    version: str  # of the program
    rates: str  # of physics and control, as shown
    renderer: str  # what drew the images
    simulated_s: float
    processor_s: float  # without start-up and warming up
    wall_s: float
    images: int  # delivered
    contrast: float  # standard deviation of the last image's values: 0 if nothing is to be seen
    miss_m: float = 0.0  # distance from the last goal at the end; 0 where there are no goals
    path: tuple[tuple[float, ...], ...] = ()  # time, x, y, z, yaw of the flight that the others repeat


class GoalFollower:
    """The goal that holds at a time; times must not decrease."""

    def __init__(self, goals: tuple[Goal, ...]) -> None:
        self._goals = goals
        self._index = 0

    def at(self, time_s: float) -> Goal:
        """The goal that holds at this time."""
        goals = self._goals
        while self._index + 1 < len(goals) and goals[self._index + 1].time_s <= time_s:
            self._index += 1
        return goals[self._index]


def answer(fly: Callable[[Job], Flight]) -> None:
    """Read a job, fly it, write the flight as the last line of the output; end with a code."""
    try:
        flight = fly(Job.from_json(sys.stdin.read()))
    except CannotFlyError as error:
        print(error, file=sys.stderr)
        sys.exit(EXIT_CANNOT_FLY)
    sys.stdout.flush()
    print("\n" + json.dumps(asdict(flight)), flush=True)


def keep_image(job: Job, image: Any) -> float:
    """Save the last image where the job says; return its contrast."""
    if job.image_file:
        import numpy as np

        np.save(job.image_file, image)
    return float(image[:, :, :3].std())
