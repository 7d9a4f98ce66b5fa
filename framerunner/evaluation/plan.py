"""What an evaluation flies, which scenarios and which mission, and the identity by which it is recognised."""

from __future__ import annotations

import hashlib
import inspect
import json
import re
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from importlib import metadata
from pathlib import Path
from typing import Any

from framerunner.errors import SettingError
from framerunner.evaluation import COUNT, SEED
from framerunner.files.yaml_file import SUFFIXES
from framerunner.flying.plan import FlightPlan
from framerunner.flying.response import ResponseDelay
from framerunner.vehicle.airframe import AirframeError, load_airframe
from offboard.mission import Mission
from offboard.pilot import Pilot
from offboard.pilot_file import PilotFile
from scenarios.loader import load_scenario
from scenarios.models import Scenario, ScenarioError
from scenarios.random_scenarios import load_level, random_scenario


@dataclass(frozen=True, slots=True)
class Identity:
    """What results depend on: evaluations with equal identities have equal results.

    Attributes:
        scenarios: SHA-256 of each scenario's content, by name, in order.
        mission: its name.
        mission_sha256: of the expanded chart with its variables, class and vision.
        pilot: name of the contestant's file or class.
        pilot_sha256: of the contestant's file, or of the module of another package's class; empty for ours.
        seeds: of everything random in each flight, in the scenarios' order.
        version: of framerunner.
        response: how late the vehicle answers; empty: as its autopilot does.
        autopilot: a genuine one that flies, with the hash of its program; empty: our own.
    """

    scenarios: Mapping[str, str]
    mission: str
    mission_sha256: str
    pilot: str
    pilot_sha256: str
    seeds: tuple[int, ...]
    version: str
    response: str
    autopilot: str = ""

    @property
    def sha256(self) -> str:
        """Over all fields."""
        return _sha256(json.dumps(self.as_data()))

    def as_data(self) -> dict[str, Any]:
        """The fields as plain data; `autopilot` only if a genuine one flies."""
        data = asdict(self)
        if not self.autopilot:
            del data["autopilot"]
        return data

    def difference(self, other: Identity) -> str:
        """The first difference in a few words; empty if there is none."""
        for what in ("mission", "pilot", "version", "response", "autopilot"):
            missing = "our own" if what == "autopilot" else "none"
            ours, theirs = getattr(self, what) or missing, getattr(other, what) or missing
            if ours != theirs:
                return f"{what} {theirs}, not {ours}"
        if self.mission_sha256 != other.mission_sha256:
            return f"another content of mission {self.mission}"
        if self.pilot_sha256 != other.pilot_sha256:
            return f"another content of {self.pilot}"
        if list(self.scenarios.items()) != list(other.scenarios.items()):
            changed = [
                name for name, digest in self.scenarios.items() if other.scenarios.get(name, digest) != digest
            ]
            if changed:
                return f"another content of scenario {changed[0]}"
            return f"other scenarios ({_count(other.scenarios)}, not {_count(self.scenarios)})"
        return "" if self.seeds == other.seeds else "other seeds"


@dataclass(frozen=True)
class EvaluationPlan:
    """What is to be flown.

    Attributes:
        title: for people, such as "level calm, seeds 1 to 200".
        label: for a folder's name.
        scenarios: in order; names are unique.
        mission: checked.
        seeds: of everything random in each flight; that of a random scenario is its own.
        response: how late the vehicle answers; None: as its autopilot does.
        autopilot: as in `Identity`.
    """

    title: str
    label: str
    scenarios: Sequence[Scenario]
    mission: Mission
    seeds: Sequence[int]
    response: ResponseDelay | None = None
    autopilot: str = ""

    def __len__(self) -> int:
        return len(self.scenarios)

    @cached_property
    def identity(self) -> Identity:
        """What results depend on."""
        mission, pilot = self.mission, self.mission.pilot
        variables = json.dumps(mission.spec.variables, sort_keys=True, default=repr)
        return Identity(
            scenarios={each.name: _sha256(each.model_dump_json()) for each in self.scenarios},
            mission=mission.name,
            mission_sha256=_sha256(f"{mission.chart_text}\n{variables}\n{mission.rules}"),
            pilot=pilot.name if isinstance(pilot, PilotFile) else pilot.__qualname__,
            pilot_sha256=_pilot_sha256(pilot),
            seeds=tuple(self.seeds),
            version=metadata.version("framerunner"),
            response="" if self.response is None else str(self.response),
            autopilot=self.autopilot,
        )

    @property
    def default_out(self) -> Path:
        """A folder whose name depends on the identity, so that the same command finds it again."""
        return Path("runs") / f"evaluate-{self.label}-{self.mission.name}-{self.identity.sha256[:6]}"

    def answering_late(self, response: ResponseDelay) -> EvaluationPlan:
        """The same flights by a vehicle that answers late."""
        return replace(self, title=f"{self.title}, response {response}", response=response)

    def sensing_by(self, suite: str, scenarios: Sequence[Scenario]) -> EvaluationPlan:
        """The same flights by drones with another sensor suite, which these scenarios have."""
        label = f"{self.label}-{Path(suite).stem}"
        return replace(self, title=f"{self.title}, sensors {suite}", label=label, scenarios=scenarios)

    def flown_by(self, autopilot: str, scenarios: Sequence[Scenario]) -> EvaluationPlan:
        """The flights of these scenarios, changed for a genuine autopilot, of which some may be missing."""
        seeds = dict(zip((each.name for each in self.scenarios), self.seeds, strict=True))
        return replace(
            self,
            title=f"{self.title}, flown by {autopilot.partition(' ')[0]}",
            label=f"{self.label}-{autopilot.partition(' ')[0].lower()}",
            scenarios=scenarios,
            seeds=tuple(seeds[each.name] for each in scenarios),
            autopilot=autopilot,
        )

    def tasks(self, done: Collection[str] = ()) -> Iterator[FlightPlan]:
        """Flights that are not yet done, in order."""
        for scenario, seed in zip(self.scenarios, self.seeds, strict=True):
            if scenario.name not in done:
                yield FlightPlan(scenario, self.mission, seed, response=self.response)


def plan_level(level: str | Path, first_seed: int, count: int, mission: Mission) -> EvaluationPlan:
    """Plan `count` random scenarios of a level, name or file, with consecutive seeds.

    Raises:
        SettingError: the count is not positive.
        LevelError: the level is not known, or a seed is out of range.
    """
    if count < 1:
        raise SettingError(f"--count {count}: must be 1 or more")
    loaded = load_level(level)
    random_scenario(loaded, first_seed + count - 1)  # checks the last seed before thousands are drawn
    seeds = range(first_seed, first_seed + count)
    scenarios = [random_scenario(loaded, seed) for seed in seeds]
    last = f" to {first_seed + count - 1}" if count > 1 else ""
    title = f"level {loaded.name}, seed{'s' if last else ''} {first_seed}{last}"
    return EvaluationPlan(title, f"{loaded.name}-{first_seed}-{count}", _checked(scenarios), mission, seeds)


def plan_flights(
    scenarios: Sequence[str | Path | Scenario],
    level: str | Path | None,
    first_seed: int | None,
    count: int | None,
    mission: Mission,
) -> EvaluationPlan:
    """Plan given scenarios, or those of a level; seed and count are of the level.

    Raises:
        SettingError, ScenarioError, LevelError: see `plan_level` and `plan_files`; or neither is given, or
            both.
    """
    if level is None and not scenarios:
        raise SettingError(
            "--level: say what to fly: a level such as calm, or names, files or folders of scenarios"
        )
    if level is not None and scenarios:
        raise SettingError(
            f"--level {level}: does not go with {_shown(scenarios[0])}; give a level or scenarios, not both"
        )
    for option, value in (("--count", count), ("--seed", first_seed)):
        if level is None and value is not None:
            raise SettingError(f"{option} {value}: is for scenarios of a level; add --level, or leave it out")
    if level is None:
        return plan_files(scenarios, mission)
    return plan_level(
        level, SEED if first_seed is None else first_seed, COUNT if count is None else count, mission
    )


def plan_files(sources: Sequence[str | Path | Scenario], mission: Mission) -> EvaluationPlan:
    """Plan given scenarios: names, files, folders of scenario files, or scenarios.

    Raises:
        ScenarioError: one of them is invalid.
        SettingError: a folder has none, or two have the same name.
    """
    named: dict[str, str] = {}
    scenarios = []
    for given in [given for source in sources for given in _files(source)]:
        scenario = given if isinstance(given, Scenario) else load_scenario(given)
        if scenario.name in named:
            raise SettingError(
                f"{_shown(given)}: its name {scenario.name} is that of {named[scenario.name]} too; give each "
                "its own"
            )
        named[scenario.name] = _shown(given)
        scenarios.append(scenario)
    title = ", ".join(map(_shown, sources)) if len(sources) <= 4 else f"{len(sources)} scenarios"
    stem = Path(_shown(sources[0])).stem.lower() if len(sources) == 1 else ""
    label = re.sub(r"[^a-z0-9_-]+", "-", stem).strip("-")
    return EvaluationPlan(
        title, label[:40] or "scenarios", _checked(scenarios), mission, [0] * len(scenarios)
    )


def _shown(source: str | Path | Scenario) -> str:
    """A scenario as it was given, for people."""
    return f"scenario {source.name}" if isinstance(source, Scenario) else str(source)


def _files(source: str | Path | Scenario) -> Sequence[str | Path | Scenario]:
    if isinstance(source, Scenario) or not (path := Path(source)).is_dir():
        return [source]
    files = sorted(str(each) for each in path.iterdir() if each.suffix in SUFFIXES)
    if not files:
        raise SettingError(f"{source}: has no scenario files; they end in {' or '.join(SUFFIXES)}")
    return files


def _checked(scenarios: list[Scenario]) -> list[Scenario]:
    """Load every airframe once, since a bad one would fail only at take-off."""
    first: dict[str, Scenario] = {}
    for scenario in scenarios:
        first.setdefault(scenario.airframe, scenario)
    for scenario in first.values():
        try:
            load_airframe(scenario.airframe)
        except AirframeError as error:
            raise ScenarioError(f"scenario {scenario.name}: {error}") from None
    return scenarios


def _pilot_sha256(pilot: PilotFile | type[Pilot]) -> str:
    if isinstance(pilot, PilotFile):
        return _sha256(pilot.text)
    if pilot is Pilot:
        return ""
    try:
        return _sha256(inspect.getsource(sys.modules[pilot.__module__]))
    except (OSError, TypeError):  # it was typed into an interpreter
        return ""


def _sha256(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _count(scenarios: Mapping[str, str]) -> str:
    return f"{len(scenarios)} from {next(iter(scenarios), 'none')}"
