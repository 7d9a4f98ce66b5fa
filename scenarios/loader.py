"""Scenarios by name or from files, with faults reported by file, line and field."""

from __future__ import annotations

import difflib
import re
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from scenarios.complaints import Fault, describe_faults, shorten, show
from scenarios.level import list_levels, load_level
from scenarios.models import Scenario, ScenarioError
from scenarios.yaml_file import FileKind, is_path, packaged
from scenarios.yaml_tree import to_yaml

_SOME_SEED = re.compile(r"[0-9]{1,19}")


_KIND = FileKind("scenario", ScenarioError)


def list_scenarios() -> list[str]:
    """Names of the scenarios that come with the package, sorted."""
    return packaged("files")


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Load a scenario that comes with the package, a random one by its name, or any YAML file.

    Args:
        name_or_path: a name of `list_scenarios`; level and seed of a random one, such as "calm-17"; or a
            path: it has a directory or ends in .yaml or .yml.

    Raises:
        ScenarioError: there is no such scenario, or the file is not a valid one.
    """
    text = str(name_or_path)
    names = list_scenarios()
    if is_path(name_or_path):
        return parse_scenario(_KIND.read(Path(text), names), source=shorten(text))
    if text not in names:
        return _random(text, names)
    entry = resources.files("scenarios") / "files" / f"{text}.yaml"
    return parse_scenario(entry.read_bytes(), source=entry.name)


def parse_scenario(content: bytes | str, source: str = "scenario") -> Scenario:
    """Check the content of a scenario file.

    Args:
        content: YAML, as UTF-8 when bytes.
        source: what to call it in messages, usually the file's path.

    Raises:
        ScenarioError: it is not a valid scenario; the message names line, field, value and what to do.
    """
    tree = _KIND.parse(content, source)
    try:
        return Scenario.model_validate(tree.value, strict=True)
    except ValidationError as error:
        faults = [Fault.from_pydantic(detail) for detail in error.errors(include_url=False)]
        raise ScenarioError(describe_faults(source, tree, faults)) from None


def dump_yaml(scenario: Scenario) -> str:
    """Write a scenario as YAML, every field included; `parse_scenario` gives an equal scenario back."""
    return to_yaml(scenario.model_dump(mode="json"))


def json_schema() -> dict[str, Any]:
    """JSON Schema of a scenario file, for editors and other tools."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Scenario.model_json_schema()}


def _random(name: str, known: list[str]) -> Scenario:
    """The scenario that `random_scenario` gives this name."""
    from scenarios.random_scenarios import random_scenario  # noqa: PLC0415 - it imports numpy

    level, _, seed = name.rpartition("-")
    levels = list_levels()
    if level not in levels or not re.fullmatch(r"0|[1-9][0-9]{0,30}", seed):
        raise ScenarioError(_unknown_name(name, known, levels))
    return random_scenario(load_level(level), int(seed))


def _unknown_name(name: str, names: list[str], levels: list[str]) -> str:
    nearest = difflib.get_close_matches(name.lower(), names, n=1, cutoff=0.5)
    level, _, seed = name.lower().rpartition("-")
    if _SOME_SEED.fullmatch(seed):
        near_levels = difflib.get_close_matches(level, levels, n=1, cutoff=0.5)
        nearest = [f"{near_levels[0]}-{int(seed)}"] if near_levels else nearest
    hint = f"; did you mean {nearest[0]}?" if nearest else ";"
    random = " or ".join(f"{level}-<seed>" for level in levels)
    return (
        f"unknown scenario {show(name)}{hint} Known: {', '.join(names)}; a random one is {random}; "
        "or give the path of a .yaml file"
    )
