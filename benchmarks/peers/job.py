"""What every program in the comparison is given, and what it gives back: JSON on standard input and output.

Only the standard library, as the peers' environment has nothing of this project. Axes are the arena's: x
forward, y left, z up, yaw counter-clockwise from x.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

EXIT_CANNOT_FLY = 3
EGL_MEND = "On Debian and Ubuntu: sudo apt install libegl1 libgl1-mesa-dri"

Vec3 = tuple[float, float, float]


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
    """One flight to be timed.

    Attributes:
        variant: how the program is set; see `benchmarks.contenders`.
        scenario: name or file, for the program that knows scenarios.
        seconds: of the flight.
        image_rate_hz: images a second of flight.
        width_px: of an image.
        height_px: of an image.
        vertical_fov_rad: angle of view over the height.
        camera_flu_m: where on the drone the camera is, looking forward.
        arena_m: extent of the floor along x and y.
        sun_direction: the way its light travels.
        boxes: base and frames.
        goals: in order of time; the first is the start.
        image_file: where to leave the last image (NumPy's format); empty for nowhere.
    """

    variant: str
    scenario: str
    seconds: float
    image_rate_hz: float
    width_px: int = 320
    height_px: int = 240
    vertical_fov_rad: float = 1.29
    camera_flu_m: Vec3 = (0.0, 0.0, 0.0)
    arena_m: tuple[float, float] = (10.0, 10.0)
    sun_direction: Vec3 = (0.0, 0.0, -1.0)
    boxes: tuple[Box, ...] = ()
    goals: tuple[Goal, ...] = ()
    image_file: str = ""

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
    """What a flight cost.

    Attributes:
        version: of the program.
        rates: of physics and control, in words.
        renderer: what drew the images.
        simulated_s: length of the flight.
        processor_s: processor time, without start-up and warming up.
        wall_s: the same by the wall clock.
        images: how many were delivered.
        contrast: standard deviation of the last image's values: 0 if nothing is to be seen.
        miss_m: distance from the last goal at the end; 0 where there are no goals.
        path: time, x, y, z, yaw along the flight, from the program whose flight the others repeat.
    """

    version: str
    rates: str
    renderer: str
    simulated_s: float
    processor_s: float
    wall_s: float
    images: int
    contrast: float
    miss_m: float = 0.0
    path: tuple[tuple[float, ...], ...] = ()


class GoalFollower:
    """Tells which goal holds; ask it in order of time."""

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
    """Leave the last image where the job wants it; return its contrast."""
    if job.image_file:
        import numpy as np

        np.save(job.image_file, image)
    return float(image[:, :, :3].std())
