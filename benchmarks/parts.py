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
        cost: with its unit.
        runs: the same in `run()`s of JSBSim.
        real_time: how many times faster than real time, where that means something.
        verdict: the aim and whether it is reached; empty without an aim.
    """

    name: str
    cost: str
    runs: float
    real_time: float | None = None
    verdict: str = ""


def part_rows(parts: dict[str, Any], physics_rate_hz: float) -> list[PartRow]:
    """Make the rows.

    Args:
        parts: what `benchmarks/lockstep.py --json` printed.
        physics_rate_hz: steps of JSBSim in a second of flight.
    """
    raw_s = parts["raw_s"]

    def row(name: str, cost_s: float, *, whole: bool = False, aim: float | None = None) -> PartRow:
        runs = cost_s / raw_s
        verdict = "" if aim is None else f"<= {aim:.1f}: {'reached' if runs <= aim else 'missed'}"
        real_time = 1 / (cost_s * physics_rate_hz) if whole else None
        return PartRow(name, f"{cost_s * 1e6:.1f} us", runs, real_time, verdict)

    step_of_flight_s = parts["flight_s"] / (parts["simulated_s"] * physics_rate_hz)
    return [
        row("JSBSim run()", raw_s, whole=True),
        row("physics + autopilot, a step", parts["step_s"], whole=True, aim=STEP_AIM_RUNS),
        row("an image painted", parts["render_s"]),
        row("an image searched", parts["detect_s"]),
        row("the whole challenge, a step", step_of_flight_s, whole=True, aim=FLIGHT_AIM_RUNS),
    ]
