"""Shows what was measured, and writes it down."""

from __future__ import annotations

import os
import platform
import sys
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.compare import Comparison, cost
from benchmarks.contenders import CONTENDERS
from benchmarks.parts import PartRow
from benchmarks.peers.job import Flight, Job
from benchmarks.run import Results


def machine() -> dict[str, str]:
    """What the figures were measured on."""
    return {
        "processor": processor(),
        "cores": str(os.cpu_count()),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
    }


def processor() -> str:
    """The processor's name, where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else "unknown"


def show_parts(console: Console, rows: list[PartRow], title: str) -> None:
    """What the parts of our flight cost."""
    table = Table(title=title, title_justify="left")
    table.add_column("part of ours", no_wrap=True)
    table.add_column("costs", justify="right")
    table.add_column("x run()", justify="right")
    table.add_column("aim", no_wrap=True)
    table.add_column("of the whole", justify="right")
    table.add_column("x real time", justify="right")
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
    """Whether an aim is reached, in a word."""
    return "reached" if reached else "missed"


def show_comparison(console: Console, results: Results, job: Job) -> None:
    """Ours beside the peers."""
    image = f"{job.width_px} x {job.height_px} image at {job.image_rate_hz:g} Hz"
    title = f"{job.seconds:g} s of flight, {image}, one core"
    table = Table(title=title, title_justify="left")
    table.add_column("program", no_wrap=True)
    table.add_column("settings")
    table.add_column("x real time", justify="right")
    table.add_column("costs x ours", justify="right")
    table.add_column("aim")
    table.add_column("pairs", justify="right")
    table.add_column("rates")
    table.add_column("drawn by")
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
    """A row of the table."""
    peer, contender = comparison.peer, comparison.contender
    least, greatest = comparison.spread
    return (
        f"{contender.name} {peer.version}",
        contender.settings,
        f"{1 / cost(peer):.1f}",
        f"{comparison.ratio:.1f}",
        f">= {contender.target:g} {verdict(comparison.reached)}",
        f"{least:.1f} - {greatest:.1f}",
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
