"""Scenarios by name, for the monitor: a user's own files, the installed ones, and random layouts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from scenarios.loader import list_scenarios, load_scenario
from scenarios.models import Scenario, ScenarioError

_MAX_FILES = 500


class ScenarioLibrary:
    """Reads own files again at each question, so that one that is added or changed counts at once.

    Args:
        places: files, and folders of which the `.yaml` files count; what does not exist is left out. Files
            that are no scenarios are left out, as are those whose name another one before them has.
    """

    def __init__(self, places: Sequence[Path]) -> None:
        self._places = places
        self._kept: dict[Path, tuple[tuple[int, int], Scenario | None]] = {}  # by size and time of change

    def names(self) -> list[str]:
        """Names of the own and the installed scenarios, the own ones first."""
        own = {scenario.name for _, scenario in self._own()}
        return [*sorted(own), *(name for name in list_scenarios() if name not in own)]

    def load(self, name: str) -> Scenario:
        """The scenario of a name; an own one goes before an installed one. Raises `ScenarioError`."""
        own = (scenario for _, scenario in self._own() if scenario.name == name)
        return next(own, None) or load_scenario(name)

    def argument(self, name: str) -> str:
        """What `framerunner fly` is given to fly a scenario: its name, or the path of an own file."""
        return next((str(path) for path, scenario in self._own() if scenario.name == name), name)

    def _own(self) -> Iterator[tuple[Path, Scenario]]:
        for path in self._files()[:_MAX_FILES]:
            scenario = self._read(path)
            if scenario is not None:
                yield path, scenario

    def _read(self, path: Path) -> Scenario | None:
        """A file's scenario, read only if the file has changed."""
        try:
            status = path.stat()
            stamp = (status.st_size, status.st_mtime_ns)
            kept = self._kept.get(path)
            if kept is None or kept[0] != stamp:
                kept = self._kept[path] = (stamp, load_scenario(path))
        except OSError:
            return None
        except ScenarioError:
            kept = self._kept[path] = (stamp, None)
        return kept[1]

    def _files(self) -> list[Path]:
        found = (sorted(place.glob("*.yaml")) if place.is_dir() else [place] for place in self._places)
        return [path for each in found for path in each if path.is_file()]
