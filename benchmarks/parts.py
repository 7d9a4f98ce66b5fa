"""What the parts of a flight of ours cost, as ratios to JSBSim's own step, with what they are to be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

STEP_AIM_RUNS = 10.0
FLIGHT_AIM_RUNS = 40.0 / 3.0
"""60 times real time where a `run()` takes 2.5 µs (the issue's machine): 500 steps a second are then allowed
1 / (60 * 500 * 2.5e-6) = 13.3 `run()`s each, whatever the machine."""


@dataclass(frozen=True, slots=True)
class PartRow:
    """A row of the table.

    Attributes:
        name: of the part.
        cost_s: of one such thing, seconds.
        runs: the same in `run()`s of JSBSim.
        share: of the whole flight's cost; None for what is not a part of it by itself.
        real_time: how many times faster than real time, where that means something.
        aim_runs: the most it is to cost.
    """

    name: str
    cost_s: float
    runs: float
    share: float | None = None
    real_time: float | None = None
    aim_runs: float | None = None

    @property
    def reached(self) -> bool | None:
        """Whether it costs no more than it is to; None without an aim."""
        return None if self.aim_runs is None else self.runs <= self.aim_runs


def part_rows(parts: dict[str, Any], physics_rate_hz: float) -> list[PartRow]:
    """Make the rows.

    Args:
        parts: what `benchmarks/lockstep.py --json` printed.
        physics_rate_hz: steps of JSBSim in a second of flight.
    """
    raw_s, step_s = parts["raw_s"], parts["step_s"]
    image_rate_hz = parts["image_rate_hz"]
    whole_s = parts["flight_s"] / (parts["simulated_s"] * physics_rate_hz)  # a step's share of the flight
    images_a_step = image_rate_hz / physics_rate_hz
    rest_s = whole_s - step_s - images_a_step * (parts["render_s"] + parts["detect_s"])

    def step(name: str, cost_s: float, share: float | None, aim_runs: float | None = None) -> PartRow:
        return PartRow(name, cost_s, cost_s / raw_s, share, 1 / (cost_s * physics_rate_hz), aim_runs)

    def image(name: str, cost_s: float) -> PartRow:
        return PartRow(name, cost_s, cost_s / raw_s, images_a_step * cost_s / whole_s)

    return [
        step("JSBSim run()", raw_s, None),
        step("physics + autopilot, a step", step_s, step_s / whole_s, STEP_AIM_RUNS),
        image("an image painted", parts["render_s"]),
        image("an image searched", parts["detect_s"]),
        PartRow("navigator and all the rest, a step", rest_s, rest_s / raw_s, rest_s / whole_s),
        step("the whole challenge, a step", whole_s, 1.0, FLIGHT_AIM_RUNS),
    ]
