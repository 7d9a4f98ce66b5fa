"""The benchmarks in one command: what our flight costs, part by part, and beside its peers.

    python -m benchmarks [--peers none|mujoco|pyflyt|all] [--repeats 3] [--json FILE]

Run from the top of the repository; `make bench` does. docs/benchmarks.md says what the figures mean.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from rich.console import Console

from benchmarks.compare import IMAGE_RATES_HZ, BadResultError, chosen
from benchmarks.report import as_json, machine, part_rows, show_comparison, show_parts
from benchmarks.run import compare_all, job_for, measure_parts
from scenarios.loader import load_scenario
from scenarios.models import Scenario, ScenarioError
from sitl.world import PHYSICS_RATE_HZ

EXIT_INCOMPLETE = 1
EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130


def main() -> int:
    """Measure, show, save; return the exit code."""
    options = read_options()
    console = Console(width=None if sys.stdout.isatty() else 130)
    try:
        scenario = load_scenario(options.scenario)
        return measure(options, scenario, console)
    except (BadResultError, ScenarioError) as error:
        print(f"error: {error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return EXIT_INTERRUPTED


def read_options() -> argparse.Namespace:
    """Read and check the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__.partition("\n")[0])
    parser.add_argument(
        "--peers", default="all", choices=("none", "mujoco", "pyflyt", "all"), help="compared with ours"
    )
    parser.add_argument("--repeats", type=int, default=3, metavar="N", help="pairs of flights (default 3)")
    parser.add_argument("--image-rate", type=int, default=10, choices=IMAGE_RATES_HZ, help="Hz (default 10)")
    parser.add_argument("--seconds", type=float, default=20.0, metavar="S", help="of flight (default 20)")
    parser.add_argument("--scenario", default="test-case-1", metavar="NAME", help="name or file")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all that was measured")
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="keep the last image of each program")
    options = parser.parse_args()
    if options.repeats < 1:
        parser.error(f"--repeats {options.repeats}: must be 1 or more")
    if not 5 <= options.seconds <= 600:
        parser.error(f"--seconds {options.seconds:g}: must be from 5 to 600")
    if options.json and not options.json.absolute().parent.is_dir():
        parser.error(f"--json {options.json}: there is no folder {options.json.parent}")
    return options


def measure(options: argparse.Namespace, scenario: Scenario, console: Console) -> int:
    """Measure what the options select, showing each part when it is ready."""
    job = job_for(scenario, options.scenario, options.seconds, options.image_rate)
    if options.pictures:
        options.pictures.mkdir(parents=True, exist_ok=True)
    with console.status("starting") as status:

        def say(words: str) -> None:
            status.update(words[: max(20, console.width - 4)])

        parts = measure_parts(options.scenario, options.repeats, say)
        rows = part_rows(parts, PHYSICS_RATE_HZ)
        length_s, rate_hz = parts["simulated_s"], parts["image_rate_hz"]
        show_parts(
            console, rows, f"{scenario.name}, {length_s:.0f} s of flight, camera {rate_hz:g} Hz, one core"
        )
        results = compare_all(job, chosen(options.peers), options.repeats, say, options.pictures)
    show_comparison(console, results, job)
    console.print(", ".join(f"{name} {value}" for name, value in machine().items()), markup=False)
    if options.json:
        options.json.write_text(json.dumps(as_json(parts, results, job), indent=1) + "\n", encoding="utf-8")
    if options.pictures:
        keep_pictures(options.pictures)
    return EXIT_INCOMPLETE if results.failed else 0


def keep_pictures(folder: Path) -> None:
    """Convert the images that the programs saved to PNG files."""
    import cv2
    import numpy as np

    for path in sorted(folder.glob("*.npy")):
        cv2.imwrite(str(path.with_suffix(".png")), np.load(path)[:, :, 2::-1])
        path.unlink()


if __name__ == "__main__":
    sys.exit(main())
