"""`framerunner bound`: how fast a scenario can be flown at best."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from framerunner.commands import say
from framerunner.errors import SettingError

if TYPE_CHECKING:
    from scenarios.models import MissionClass

_MAX_SCENARIOS = 10_000


def bound(
    scenario: str | None = None,
    *,
    level: str | None = None,
    seeds: str | None = None,
    mission_class: Annotated[Literal["contest", "open"], Parameter(name="--class")] = "contest",
    out: Path | None = None,
) -> int:
    """For a pilot who knows the layout: a lower bound of the time of a try, and a flight that is possible.

    No flight that keeps to the class's limits can be faster than the bound; docs/bound.md has the proof. The
    flight that is possible is the navigator's own plan.

    **Examples**

        framerunner bound test-case-1 --out bound.png

        framerunner bound --level calm --seeds 1:300

    Args:
        scenario: name or file
        level: scenarios of this level, name or file, instead of one
        seeds: of the level's scenarios: the first and the last, such as 1:300
        mission_class: of the mission's limits
        out: PNG file: one scenario with both paths
    """
    if (scenario is None) == (level is None):
        raise SettingError("bound: give either a scenario or --level and --seeds")
    if level is None:
        if seeds is not None:
            raise SettingError(f"--seeds {seeds}: is for scenarios of a level; add --level, or leave it out")
        return _bound_one(str(scenario), mission_class, out)
    if seeds is None:
        raise SettingError("--seeds: say which, such as 1:300")
    if out is not None:
        raise SettingError(f"--out {out}: is for one scenario; name it instead of --level, or leave it out")
    return _bound_level(level, _seeds(seeds), mission_class)


def _bound_one(scenario: str, mission_class: MissionClass, out: Path | None) -> int:
    from framerunner.flying.envelopes import bound_of
    from framerunner.flying.feasible import feasible
    from framerunner.flying.plan import FlightPlan
    from framerunner.runs import check_plot_format
    from scenarios.bound import ordered_gates
    from scenarios.loader import load_scenario

    if out is not None:
        check_plot_format(out)
    loaded = load_scenario(scenario)
    plan = FlightPlan(loaded)
    least = bound_of(plan, mission_class)
    possible = feasible(plan, mission_class)
    head = f"{loaded.name}, class {mission_class}"
    print(f"{head}: no try is shorter than {least.time_s:.2f} s")
    print(f"{'':12}{'x':>8}{'y':>8}{'z':>8}{'leg (s)':>10}")
    names = ["start", *(gate.colour for gate in ordered_gates(loaded)), "motors off"]
    legs = ["", *(f"{leg_s:10.2f}" for leg_s in least.leg_times_s)]
    for name, (x, y, z), leg in zip(names, least.points_arena_m, legs, strict=True):
        print(f"{name:12}{x:8.2f}{y:8.2f}{z:8.2f}{leg}")
    paths = {f"the bound: {least.time_s:.1f} s": least.points_arena_m}
    if isinstance(possible, str):
        print(f"no flight was planned: {possible}")
    else:
        times = possible.time_s / least.time_s
        print(f"possible: {possible.time_s:.2f} s, {times:.2f} times the bound")
        paths[f"a flight that is possible: {possible.time_s:.1f} s"] = possible.points_arena_m
    if out is not None:
        from framerunner.runs.plots import draw_paths, save_figure

        save_figure(draw_paths(loaded, paths, head), out)
        say(f"drawn to {out}")
    return 0


def _bound_level(level: str, seeds: range, mission_class: MissionClass) -> int:
    import numpy as np

    from framerunner.flying.envelopes import bound_of
    from framerunner.flying.feasible import feasible
    from framerunner.flying.plan import FlightPlan
    from scenarios.random_scenarios import load_level, random_scenario

    loaded = load_level(level)
    bounds_s, possible_s, times = [], [], []
    print(f"{'':24}{'bound (s)':>11}{'possible (s)':>14}{'times':>8}")
    for seed in seeds:
        plan = FlightPlan(random_scenario(loaded, seed))
        bounds_s.append(bound_of(plan, mission_class).time_s)
        line = f"{plan.scenario.name:24}{bounds_s[-1]:11.2f}"
        possible = feasible(plan, mission_class)
        if not isinstance(possible, str):
            possible_s.append(possible.time_s)
            times.append(possible.time_s / bounds_s[-1])
            line += f"{possible_s[-1]:14.2f}{times[-1]:8.2f}"
        print(line)
    columns = ((bounds_s, "11.2f"), (possible_s, "14.2f"), (times, "8.2f"))
    for name, share in (("5 %", 0.05), ("median", 0.5), ("95 %", 0.95)):
        cells = (format(float(np.quantile(numbers, share)), form) for numbers, form in columns if numbers)
        print(f"{name + ', class ' + mission_class:24}{''.join(cells)}")
    return 0


def _seeds(text: str) -> range:
    """The seeds of A:B, both included; SettingError if it is no such text."""
    match = re.fullmatch(r"(\d{1,18}):(\d{1,18})", text)
    if match is None or int(match[1]) > int(match[2]):
        raise SettingError(f"--seeds {text}: give the first and the last, such as 1:300")
    first, last = int(match[1]), int(match[2])
    if last - first >= _MAX_SCENARIOS:
        raise SettingError(f"--seeds {text}: at most {_MAX_SCENARIOS} at once; give fewer")
    return range(first, last + 1)
