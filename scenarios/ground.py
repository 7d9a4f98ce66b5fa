"""What lies under the drone: the base's square top, or the floor."""

from __future__ import annotations

from geometry.vectors import Vec3
from scenarios.models import Base, Scenario


def is_over_base(base: Base, x_m: float, y_m: float) -> bool:
    """Whether a point in plan lies over the base's square, its border included (the base is never turned)."""
    half_m = base.edge_m / 2
    return abs(x_m - base.x_m) <= half_m and abs(y_m - base.y_m) <= half_m


def ground_height(scenario: Scenario, x_m: float, y_m: float, floor_m: float = 0.0) -> float:
    """Height of what is under a point in plan, metres; the floor is at `floor_m`."""
    return scenario.base.top_m if is_over_base(scenario.base, x_m, y_m) else floor_m


def start_position(scenario: Scenario) -> Vec3:
    """Where the drone stands at first: the point under its centre, on the base if the start is over it.

    Returns:
        Arena position in metres, shape (3,). The drone's centre is half its height above this point.
    """
    x_m, y_m = scenario.start.x_m, scenario.start.y_m
    return (x_m, y_m, ground_height(scenario, x_m, y_m))
