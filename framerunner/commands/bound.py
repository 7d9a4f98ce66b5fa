"""`framerunner bound`: how fast a scenario can be flown at best."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from errors import SettingError

if TYPE_CHECKING:
    from scenarios.models import MissionClass

_MAX_SCENARIOS = 10_000

_Level = Annotated[str | None, Parameter(help="scenarios of this level, name or file, instead of one")]
_Seeds = Annotated[
    str | None, Parameter(help="of the level's scenarios: the first and the last, such as 1:300")
]
_Class = Annotated[Literal["contest", "open"], Parameter(name="--class", help="of the mission's limits")]


def bound(
    scenario: Annotated[str | None, Parameter(help="name or file")] = None,
    *,
    level: _Level = None,
    seeds: _Seeds = None,
    mission_class: _Class = "contest",
) -> int:
    """Give a lower bound of the time of a try, for a pilot who knows the layout.

    No flight that keeps to the class's limits can be faster; docs/bound.md has the proof.

    **Examples**

        framerunner bound test-case-1

        framerunner bound --level calm --seeds 1:300
    """
    if (scenario is None) == (level is None):
        raise SettingError("bound: give either a scenario or --level and --seeds")
    if scenario is not None:
        if seeds is not None:
            raise SettingError(f"--seeds {seeds}: is for scenarios of a level; add --level, or leave it out")
        return _bound_one(scenario, mission_class)
    if seeds is None:
        raise SettingError("--seeds: say which, such as 1:300")
    assert level is not None
    return _bound_level(level, _seeds(seeds), mission_class)


def _bound_one(scenario: str, mission_class: MissionClass) -> int:
    from framerunner.flying.envelopes import bound_of
    from framerunner.flying.plan import FlightPlan
    from scenarios.bound import ordered_frames
    from scenarios.loader import load_scenario

    loaded = load_scenario(scenario)
    bound = bound_of(FlightPlan(loaded), mission_class)
    print(f"{loaded.name}, class {mission_class}: no try is shorter than {bound.time_s:.2f} s")
    names = ["start", *(frame.colour for frame in ordered_frames(loaded)), "motors off"]
    print(f"{'':12}{'x':>8}{'y':>8}{'z':>8}{'leg (s)':>10}")
    for name, (x, y, z), leg_s in zip(names, bound.points_arena_m, ("", *bound.leg_times_s), strict=True):
        leg = f"{leg_s:10.2f}" if isinstance(leg_s, float) else ""
        print(f"{name:12}{x:8.2f}{y:8.2f}{z:8.2f}{leg}")
    return 0


def _bound_level(level: str, seeds: range, mission_class: MissionClass) -> int:
    from statistics import quantiles

    from framerunner.flying.envelopes import bound_of
    from framerunner.flying.plan import FlightPlan
    from scenarios.random_scenarios import load_level, random_scenario

    loaded = load_level(level)
    times_s = []
    for seed in seeds:
        drawn = random_scenario(loaded, seed)
        times_s.append(bound_of(FlightPlan(drawn), mission_class).time_s)
        print(f"{drawn.name:24} {times_s[-1]:8.2f} s")
    parts = quantiles(times_s, n=20, method="inclusive") if len(times_s) > 1 else times_s * 19
    print(
        f"{len(times_s)} scenarios, class {mission_class}: median {parts[9]:.2f} s, 90 % of them from "
        f"{parts[0]:.2f} to {parts[18]:.2f} s"
    )
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
