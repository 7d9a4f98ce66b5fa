"""Numbers of files that people write: each has a range, and what is in range flies or is refused in words."""

import copy
import math
import random
import typing
from collections.abc import Iterator
from typing import Any

import annotated_types
import pytest
import yaml
from pydantic import BaseModel

from framerunner.errors import UserError
from framerunner.flying.lockstep import fly_lockstep
from framerunner.flying.plan import FlightPlan
from framerunner.vehicle.airframe import Airframe, load_airframe
from offboard.mission import load_mission
from scenarios.loader import load_scenario
from scenarios.models import Scenario
from scenarios.random_scenarios import Level
from sitl.sensors.specs import SuiteSpec
from tests.processes import ROOT
from vision.calibration.model import Calibration

Path = tuple[str | int, ...]
SUITES = ROOT / "sitl" / "sensors" / "suites"
CHECKED_ELSEWHERE = {"size", "parameters"}  # of a fault by its kind, of the autopilot by their declarations


def numbers(kind: Any, limits: tuple[object, ...] = (), at: Path = ()) -> Iterator[tuple[Path, list[float]]]:
    """Path, and lowest and highest value as far as there are any, of each number in a type."""
    arguments = typing.get_args(kind)
    if typing.get_origin(kind) is typing.Annotated:
        own = [part for each in arguments[1:] for part in getattr(each, "metadata", [each])]
        yield from numbers(arguments[0], (*limits, *own), at)
    elif kind in (int, float):
        # The number next to an open limit is in range: above 0 it is 5e-324, which nothing survives.
        ends = {
            annotated_types.Ge: lambda each: each.ge,
            annotated_types.Gt: lambda each: math.nextafter(each.gt, math.inf),
            annotated_types.Le: lambda each: each.le,
            annotated_types.Lt: lambda each: math.nextafter(each.lt, -math.inf),
        }
        yield at, [ends[type(each)](each) for each in limits if type(each) in ends]
    elif isinstance(kind, type) and issubclass(kind, BaseModel):
        for name, field in kind.model_fields.items():
            yield from numbers(field.annotation, tuple(field.metadata), (*at, name))
    elif typing.get_origin(kind) is tuple:
        for index, each in enumerate(part for part in arguments if part is not Ellipsis):
            yield from numbers(each, limits if Ellipsis in arguments else (), (*at, index))
    else:
        for each in arguments:
            yield from numbers(each, limits, at)


@pytest.mark.parametrize(
    "model", [Scenario, Level, SuiteSpec, Airframe, Calibration], ids=lambda m: m.__name__
)
def test_every_number_has_a_range_with_ends_that_mean_something(model):
    for at, ends in numbers(model):
        if at[-1] not in CHECKED_ELSEWHERE:
            assert len(ends) == 2, at
            assert all(end == 0.0 or 1e-12 <= abs(end) < 1e9 for end in ends), at


def document(model: type[BaseModel]) -> dict[str, Any]:
    """A file's content with all that such a file can have."""
    if model is Airframe:
        return load_airframe("abejorro").model_dump(mode="json")
    if model is SuiteSpec:
        suites = [
            yaml.safe_load((SUITES / f"{name}.yaml").read_text()) for name in ("mocap", "outdoor", "flow")
        ]
        return {key: value for suite in suites for key, value in suite.items()}
    whole = load_scenario("indoor-3").model_dump(mode="json")
    crowded = load_scenario("crowded-5").model_dump(mode="json")
    whole |= {name: crowded[name] for name in ("decoys", "poles", "walls")}
    whole["wind"] = {"speed_m_s": 1.0, "turbulence_m_s": 0.3, "gust_m_s": 1.0}
    whole["goals"] = [{"hold_m": [0, 0, 1.5]}, {"face": "red"}]
    return whole


def put(content: Any, at: Path, value: float) -> None:
    """Set a number; one in a part that is not there is left out."""
    *way, last = at
    for step in way:
        if (
            not (step in content if isinstance(content, dict) else step < len(content))
            or content[step] is None
        ):
            return
        content = content[step]
    content[last] = value


@pytest.mark.parametrize("model", [Scenario, SuiteSpec, Airframe], ids=lambda m: m.__name__)
def test_what_is_in_range_flies_or_is_refused_in_words(model, tmp_path):
    hover, whole, draw = load_mission("hover"), document(model), random.Random(17)
    every = [(at, ends) for at, ends in numbers(model) if at[-1] not in CHECKED_ELSEWHERE]
    path, flown = tmp_path / "extreme.yaml", 0
    for at, ends in draw.sample(every, 4 if model is Scenario else 12):
        content = copy.deepcopy(whole)
        put(content, at, draw.choice(ends))
        path.write_text(yaml.safe_dump(content), encoding="utf-8")
        try:
            if model is Scenario:
                scenario = load_scenario(str(path))
            else:
                field = "sensors" if model is SuiteSpec else "airframe"
                scenario = load_scenario("empty").model_copy(update={field: str(path)})
            fly_lockstep(FlightPlan(scenario.model_copy(update={"try_limit_s": 1.0}), hover))
            flown += 1
        except UserError:
            continue
    assert flown > 2
