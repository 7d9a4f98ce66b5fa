"""The tables of what was measured, and the same as JSON. Costs of parts are ratios to JSBSim's own step."""

from __future__ import annotations

import os
import platform
import sys
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.compare import CONTENDERS, Comparison, cost
from benchmarks.peers.job import Flight, Job
from benchmarks.run import Results

STEP_AIM_RUNS = 10.0
# 60 times real time where a `run()` takes 2.5 µs: each of the 500 steps a second may then cost
# 1 / (60 * 500 * 2.5e-6) = 13.3 `run()`s, on any machine.
FLIGHT_AIM_RUNS = 40.0 / 3.0
# Likewise 45 times real time with a mission that has a map of gates and plans paths.
MAP_FLIGHT_AIM_RUNS = 160.0 / 9.0


@dataclass(frozen=True, slots=True)
class PartRow:
    """The cost of one part of a flight."""

    name: str
    cost_s: float  # once
    runs: float  # the same in `run()`s of JSBSim
    share: float | None = None  # of the whole flight's cost; None for what is not a part of it by itself
    real_time: float | None = None  # how many times faster than real time, where that means something
    aim_runs: float | None = None  # maximum cost aimed at

    @property
    def reached(self) -> bool | None:
        """Whether the aim is reached; None without an aim."""
        return None if self.aim_runs is None else self.runs <= self.aim_runs


def part_rows(parts: dict[str, Any], physics_rate_hz: float) -> list[PartRow]:
    """The rows of the table.

    Args:
        parts: what `python -m benchmarks.lockstep --json` printed.
        physics_rate_hz: steps of JSBSim in a second of flight.
    """
    raw_s, step_s = parts["raw_s"], parts["step_s"]
    whole_s = parts["flight_s"] / (parts["simulated_s"] * physics_rate_hz)  # a step's share of the flight
    images_a_step = parts["images_per_s"] / physics_rate_hz
    rest_s = whole_s - step_s - images_a_step * (parts["render_s"] + parts["detect_s"])

    aim_runs = MAP_FLIGHT_AIM_RUNS if parts["vision"] == "frames" else FLIGHT_AIM_RUNS

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
        step("the whole challenge, a step", whole_s, 1.0, aim_runs),
    ]


def machine() -> dict[str, str]:
    """What the figures were measured on."""
    return {
        "processor": processor(),
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
    }


def processor() -> str:
    """The processor's name, where the system has it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else "unknown"


def table_of(title: str, *columns: str) -> Table:
    """An empty table; a column whose name begins with ">" is aligned to the right."""
    table = Table(title=title, title_justify="left")
    for name in columns:
        right = name.startswith(">")
        table.add_column(
            name.removeprefix(">"), justify="right" if right else "left", no_wrap=name != "settings"
        )
    return table


def show_parts(console: Console, rows: list[PartRow], title: str) -> None:
    """Show what the parts of our flight cost."""
    table = table_of(title, "part of ours", ">costs", ">x run()", "aim", ">of the whole", ">x real time")
    for row in rows:
        table.add_row(
            row.name,
            f"{row.cost_s * 1e6:.1f} µs",
            f"{row.runs:.1f}",
            "" if row.aim_runs is None else f"<= {row.aim_runs:.1f} {verdict(row.reached)}",
            "" if row.share is None else f"{row.share:.0%}",
            "" if row.real_time is None else f"{row.real_time:.0f}",
        )
    console.print(table)


def verdict(reached: bool | None) -> str:
    """Whether an aim is reached, as shown."""
    return "reached" if reached else "missed"


def show_comparison(console: Console, results: Results, job: Job) -> None:
    """Show our flight beside the peers'."""
    image = f"{job.width_px} x {job.height_px} image at {job.image_rate_hz:g} Hz"
    title = f"{job.seconds:g} s of flight, {image}, one core"
    columns = ("program", "settings", ">x real time", ">costs x ours", "aim", ">pairs", "rates", "drawn by")
    table = table_of(title, *columns)
    ours = results.ours
    program = f"framerunner {ours.version}"
    table.add_row(program, "all of it", f"{1 / cost(ours):.1f}", "1.0", "", "", ours.rates, ours.renderer)
    for each in results.comparisons:
        table.add_row(*comparison_row(each))
    console.print(table)
    for key, reason in results.failed.items():
        contender = next(each for each in CONTENDERS if each.key == key)
        console.print(f"not measured: {contender.name}, {contender.settings}: {reason}", markup=False)


def comparison_row(comparison: Comparison) -> tuple[str, ...]:
    peer, contender = comparison.peer, comparison.contender
    smallest, largest = comparison.spread
    return (
        f"{contender.name} {peer.version}",
        contender.settings,
        f"{1 / cost(peer):.1f}",
        f"{comparison.ratio:.1f}",
        f">= {contender.target:g} {verdict(comparison.reached)}",
        f"{smallest:.1f} - {largest:.1f}",
        peer.rates,
        peer.renderer.partition(" (")[0],
    )


def as_json(parts: dict[str, Any], results: Results, job: Job) -> dict[str, Any]:
    """All that was measured, for a file."""
    return {
        "machine": machine(),
        "arguments": sys.argv[1:],
        "seconds": job.seconds,
        "image_rate_hz": job.image_rate_hz,
        "parts": parts,
        "ours": _without_path(results.ours),
        "peers": [
            {
                "name": each.contender.name,
                "variant": each.contender.variant,
                "settings": each.contender.settings,
                "ratio": each.ratio,
                "ratio_spread": each.spread,
                "target": each.contender.target,
                "pairs": [
                    {"ours": _without_path(pair.ours), "peer": _without_path(pair.peer)}
                    for pair in each.pairs
                ],
            }
            for each in results.comparisons
        ],
        "not_measured": results.failed,
    }


def _without_path(flight: Flight) -> dict[str, Any]:
    values = asdict(replace(flight, path=()))
    del values["path"]
    return values
