"""Scenarios by name or from files, with faults reported by file, line and field."""

from __future__ import annotations

import difflib
import re
from pathlib import Path
from typing import Any

from framerunner.files.yaml_file import FileKind
from framerunner.files.yaml_text import to_yaml
from scenarios.models import Scenario, ScenarioError
from scenarios.random_scenarios import LEVEL_FILES, load_level, random_scenario

_FILES = FileKind("scenario", Scenario, ScenarioError, folder="files")


def list_scenarios() -> list[str]:
    """Names of the scenarios that are installed with the package, sorted."""
    return _FILES.names()


def load_scenario(name_or_path: str | Path) -> Scenario:
    """Load an installed scenario, a random one by its name, or any YAML file.

    Args:
        name_or_path: a name of `list_scenarios`; level and seed of a random one, such as "calm-17"; or a
            path: it has a directory or ends in .yaml or .yml.

    Raises:
        ScenarioError: there is no such scenario, or the file is not a valid one.
    """
    return _FILES.load(name_or_path) or _random(str(name_or_path))


def parse_scenario(content: bytes | str, source: str = "scenario") -> Scenario:
    """Check the content of a scenario file.

    Args:
        content: YAML, as UTF-8 when bytes.
        source: the file's name in messages.

    Raises:
        ScenarioError: it is not a valid scenario; the message names line, field, value and what to do.
    """
    return _FILES.parse(content, source)


def dump_yaml(scenario: Scenario) -> str:
    """Write a scenario as YAML, every field included; `parse_scenario` returns an equal scenario."""
    return to_yaml(scenario.model_dump(mode="json"))


def json_schema() -> dict[str, Any]:
    """JSON Schema of a scenario file, for editors and other tools."""
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **Scenario.model_json_schema()}


def _random(name: str) -> Scenario:
    """The scenario that `random_scenario` gives this name."""
    level, _, seed = name.rpartition("-")
    levels = LEVEL_FILES.own_names()
    levels = levels if level in levels else LEVEL_FILES.names()
    if level in levels and re.fullmatch(r"0|[1-9][0-9]{0,30}", seed):
        return random_scenario(load_level(level), int(seed))
    nearest = []
    if re.fullmatch(r"[0-9]{1,19}", seed):
        near_levels = difflib.get_close_matches(level.lower(), levels, n=1, cutoff=0.5)
        nearest = [f"{each}-{int(seed)}" for each in near_levels]
    of_levels = f"; a random one is LEVEL-SEED with a level of {', '.join(levels)}"
    raise _FILES.unknown(name, nearest, of_levels)
