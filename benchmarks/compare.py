"""The contenders, and from the lines that programs print to ratios. Pure: nothing is run here."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any

from benchmarks.peers.job import Flight, Goal, Job

IMAGE_RATES_HZ = (5, 10, 30)  # rates at which all programs can take images
MAX_IMAGES_MISSING = 2  # at the ends of a flight: each program has its own grid of exposures
MIN_CONTRAST = 1.0  # of 255; a plain grey image has none
MAX_MISS_M = 1.0
GOAL_EVERY_S = 2.0


class BadResultError(Exception):
    """What a program printed cannot be used; the message is one line."""


@dataclass(frozen=True, slots=True)
class Contender:
    """A peer with its settings."""

    peer: str  # key of its package
    name: str  # as shown
    variant: str  # key of its settings, for its module
    settings: str  # as shown
    module: str  # runs it, in the peers' environment
    target: float  # how many times cheaper our flight should be

    @property
    def key(self) -> str:
        """Names it in files."""
        return f"{self.peer}-{self.variant}"


_MUJOCO = "benchmarks.peers.mujoco_flight"
_PYFLYT = "benchmarks.peers.pyflyt_flight"

CONTENDERS = (
    Contender("mujoco", "MuJoCo", "default", "as it comes", _MUJOCO, 4.0),
    Contender("mujoco", "MuJoCo", "alike", "drawn like ours", _MUJOCO, 4.0),
    Contender("mujoco", "MuJoCo", "fastest", "fastest", _MUJOCO, 4.0),
    Contender("pyflyt", "PyFlyt", "default", "as it comes", _PYFLYT, 15.0),
    Contender("pyflyt", "PyFlyt", "fastest", "fastest", _PYFLYT, 15.0),
)


def chosen(peers: str) -> tuple[Contender, ...]:
    """The contenders of a choice: "none", "all" or the key of one peer."""
    return tuple(each for each in CONTENDERS if peers in ("all", each.peer))


@dataclass(frozen=True, slots=True)
class Pair:
    """Our flight and a peer's, flown one right after the other."""

    ours: Flight
    peer: Flight


@dataclass(frozen=True, slots=True)
class Comparison:
    """All pairs of one contender."""

    contender: Contender
    pairs: tuple[Pair, ...]

    @property
    def peer(self) -> Flight:
        """The peer's cheapest flight."""
        return best(pair.peer for pair in self.pairs)

    @property
    def ratio(self) -> float:
        """How many times as much processor time the peer takes for a second of flight, best against best."""
        return cost(self.peer) / cost(best(pair.ours for pair in self.pairs))

    @property
    def spread(self) -> tuple[float, float]:
        """The smallest and the largest ratio of a single pair."""
        ratios = [cost(pair.peer) / cost(pair.ours) for pair in self.pairs]
        return min(ratios), max(ratios)

    @property
    def reached(self) -> bool:
        """Whether our flight is as much cheaper as it should be."""
        return self.ratio >= self.contender.target


def cost(flight: Flight) -> float:
    """Processor seconds for one second of flight."""
    return flight.processor_s / flight.simulated_s


def best(flights: Iterable[Flight]) -> Flight:
    """The cheapest flight; other load on the machine only makes flights more expensive."""
    return min(flights, key=cost)


def read_flight(output: str) -> Flight:
    """Read the last line of a program's output.

    Raises:
        BadResultError: it is no flight.
    """
    values = last_object(output)
    known = {field.name for field in fields(Flight)}
    if not set(values) <= known:
        raise BadResultError(f"its result has unknown fields: {', '.join(sorted(set(values) - known))}")
    try:
        flight = Flight(**{**values, "path": tuple(map(tuple, values.get("path", ())))})
    except TypeError as error:
        raise BadResultError(f"its result is incomplete: {error}") from None
    if flight.processor_s <= 0 or flight.simulated_s <= 0:
        raise BadResultError(f"{flight.processor_s} s of processor time for {flight.simulated_s} s of flight")
    return flight


def last_object(output: str) -> dict[str, Any]:
    """The JSON object on the last line of an output; libraries may have written before it.

    Raises:
        BadResultError: there is none.
    """
    lines = [line for line in output.splitlines() if line.strip()]
    try:
        values = json.loads(lines[-1]) if lines else None
    except json.JSONDecodeError:
        values = None
    if not isinstance(values, dict):
        raise BadResultError("it ended without a result")
    return values


def minima(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """The minimum of every number over several runs; other values are the same in all."""
    first = runs[0]
    return {
        key: min(run[key] for run in runs) if isinstance(value, int | float) else value
        for key, value in first.items()
    }


def check_flight(flight: Flight, job: Job) -> None:
    """Check that a flight did the job that it was timed for.

    Raises:
        BadResultError: images are missing or empty, or the drone is not where it was sent.
    """
    wanted = job.seconds * job.image_rate_hz
    if abs(flight.images - wanted) > MAX_IMAGES_MISSING:
        raise BadResultError(f"{flight.images} images delivered instead of {wanted:g}")
    if flight.contrast < MIN_CONTRAST:
        raise BadResultError("its last image shows nothing")
    if flight.miss_m > MAX_MISS_M:
        raise BadResultError(f"its drone ended {flight.miss_m:.1f} m from where it was sent")


def goals_along(path: tuple[tuple[float, ...], ...]) -> tuple[Goal, ...]:
    """Turn a flight into steps of position: every two seconds to where it was two seconds later.

    Args:
        path: time (s), x, y, z (m), yaw (rad), in order of time; its first point becomes the first goal.
    """
    goals = [Goal(0.0, path[0][1:4], path[0][4])]
    next_s = GOAL_EVERY_S
    for time_s, x, y, z, yaw_rad in path:
        if time_s >= next_s:
            goals.append(Goal(next_s - GOAL_EVERY_S, (x, y, z), yaw_rad))
            next_s += GOAL_EVERY_S
    return tuple(goals)
