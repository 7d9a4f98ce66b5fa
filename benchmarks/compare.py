"""From the lines that programs print to ratios. Pure: nothing is run here."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any

from benchmarks.contenders import Contender
from benchmarks.peers.job import Flight, Goal, Job

IMAGES_MAY_DIFFER = 2  # at the ends of a flight: exposures are on grids of their own
LEAST_CONTRAST = 1.0  # of 255; a grey image is none
GREATEST_MISS_M = 1.0
GOAL_EVERY_S = 2.0


class BadResultError(Exception):
    """What a program printed cannot be used; the message is one line."""


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
        """The least and the greatest ratio of a single pair."""
        ratios = [cost(pair.peer) / cost(pair.ours) for pair in self.pairs]
        return min(ratios), max(ratios)

    @property
    def reached(self) -> bool:
        """Whether our flight is as much cheaper as it is to be."""
        return self.ratio >= self.contender.target


def cost(flight: Flight) -> float:
    """Processor seconds for one second of flight."""
    return flight.processor_s / flight.simulated_s


def best(flights: Iterable[Flight]) -> Flight:
    """The cheapest; what else the machine does makes a flight dearer, never cheaper."""
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


def least(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """The least of every number of several runs; what is no number is the same in all."""
    first = runs[0]
    return {
        key: min(run[key] for run in runs) if isinstance(value, int | float) else value
        for key, value in first.items()
    }


def check_flight(flight: Flight, job: Job) -> None:
    """See that a flight did the job that it was timed for.

    Raises:
        BadResultError: images are missing or empty, or the drone is somewhere else.
    """
    wanted = job.seconds * job.image_rate_hz
    if abs(flight.images - wanted) > IMAGES_MAY_DIFFER:
        raise BadResultError(f"{flight.images} images delivered instead of {wanted:g}")
    if flight.contrast < LEAST_CONTRAST:
        raise BadResultError("its last image shows nothing")
    if flight.miss_m > GREATEST_MISS_M:
        raise BadResultError(f"its drone ended {flight.miss_m:.1f} m from where it was sent")


def goals_along(path: tuple[tuple[float, ...], ...]) -> tuple[Goal, ...]:
    """Turn a flight into steps of position: every two seconds to where it was two seconds later.

    Args:
        path: time (s), x, y, z (m), yaw (rad), in order of time.

    Returns:
        The start, then the steps.
    """
    goals = [_goal(0.0, path[0])]
    next_s = GOAL_EVERY_S
    for point in path:
        if point[0] >= next_s:
            goals.append(_goal(next_s - GOAL_EVERY_S, point))
            next_s += GOAL_EVERY_S
    return tuple(goals)


def _goal(time_s: float, point: tuple[float, ...]) -> Goal:
    _, x, y, z, yaw_rad = point
    return Goal(time_s, (x, y, z), yaw_rad)
