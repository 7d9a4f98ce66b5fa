"""Measures what each dependency and each extra adds to an installation, for docs/installation.md."""

from __future__ import annotations

import platform
import re
import sys
import tomllib
from collections.abc import Iterable
from datetime import date
from importlib.metadata import Distribution, distributions
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.release.artefacts import ROOT
from tests.release.run_installed import Installed, StepError

DOCUMENT = ROOT / "docs" / "installation.md"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
BEGIN, END = "<!-- begin of what --sizes writes -->", "<!-- end of what --sizes writes -->"
DEPENDENCIES = {  # what a flight and its result need each for
    "aiohttp": "in real time: the camera's images over HTTP, and the referee's report",
    "cyclopts": "the command line",
    "filelock": "simulators side by side, and evaluations that are continued",
    "filterpy": "the Kalman filters of wind and of the map of frames",
    "jinja2": "new missions, reports and flight cards",
    "joblib": "many flights on all cores",
    "jsbsim": "flight dynamics",
    "matplotlib": "`track.png`, and the plots of reports and flight cards",
    "mavsdk": "flights in real time: the app's side of MAVLink",
    "numpy": "camera, vision, estimation",
    "opencv-python-headless": "rendering the camera's images, finding frames in them, and `video.avi`",
    "pydantic": "checking scenarios, missions and results",
    "pygeomag": "the Earth's magnetic field",
    "pymavlink": "MAVLink's messages: the drone's side",
    "pyserial": "a real drone at a serial port",
    "PyYAML": "scenarios and missions are YAML",
    "rich": "what is shown during a flight",
    "scipy": "design of the stabiliser, planning of paths",
}
EXTRAS = {  # what each adds
    "all": "`monitor`, `recording` and `video` together",
    "monitor": "`monitor`, `edit`, `--monitor`",
    "recording": "`--record`, and `replay` of flights in lockstep and of `.mcap` files",
    "video": "`film`, and the camera's video over RTP for ground stations",
    "dask": "`evaluate --backend dask`",
    "gym": "the Gymnasium environment",
    "mocap": "`mocap` with motion capture servers",
    "postgresql": "contests stored in PostgreSQL",
    "ray": "`evaluate --backend ray`",
}
NOT_FOR_USERS = frozenset({"dev", "docs", "reference"})


class Environment:
    """The packages of an environment: what each needs and how large it is."""

    def __init__(self, site_packages: Path) -> None:
        found = distributions(path=[str(site_packages)])
        self._packages: dict[str, Distribution] = {
            canonicalize_name(each.metadata["Name"]): each for each in found
        }

    def needed(self, root: str, without: str | None = None) -> set[str]:
        """The names of the packages that a requirement brings, itself too.

        Args:
            root: a requirement such as "framerunner[video]".
            without: a package that is left out, with what only it needs.
        """
        waiting, seen = [Requirement(root)], set[tuple[str, str]]()
        while waiting:
            requirement = waiting.pop()
            name = canonicalize_name(requirement.name)
            if name == without or name not in self._packages:
                continue
            for extra in ("", *requirement.extras):
                if (name, extra) not in seen:
                    seen.add((name, extra))
                    lines = self._packages[name].requires or []
                    needs = [Requirement(line) for line in lines]
                    waiting += [
                        each for each in needs if not each.marker or each.marker.evaluate({"extra": extra})
                    ]
        return {name for name, _ in seen}

    def mb(self, names: Iterable[str]) -> float:
        """What packages take, compiled bytecode too."""
        files = [self._packages[name].locate_file(each) for name in names for each in self._files(name)]
        return sum(Path(str(file)).stat().st_size for file in files if Path(str(file)).is_file()) / 1e6

    def _files(self, name: str) -> list[str]:
        return [str(file) for file in self._packages[name].files or []]


def measure(installed: Installed) -> str:
    """Install the wheel with all extras, and return the tables as Markdown."""
    installed.folder.mkdir()
    installed.make_environment()
    missing = set()
    for extra in EXTRAS:
        print(f"  installing framerunner[{extra}]", flush=True)
        try:
            installed.install(f"framerunner[{extra}]")
        except StepError as error:
            missing.add(extra)
            print(f"  framerunner[{extra}] cannot be installed here:\n{error}", flush=True)
    return tables(Environment(installed.site_packages), frozenset(missing))


def tables(environment: Environment, missing: frozenset[str]) -> str:
    """What `measure` returns, of packages that are installed."""
    base = environment.needed("framerunner")
    base_mb = environment.mb(base)
    system = f"{platform.system()} ({platform.machine()})"
    lines = [
        f"Without extras {len(base)} packages are installed; they take {base_mb:.0f} MB with bytecode;",
        f"{environment.mb(['framerunner']):.0f} MB of it is framerunner itself. Measured on {date.today()}",
        f"with Python {platform.python_version()} on {system} and the newest versions.",
        "",
        "| dependency | MB | with what only it needs, MB | for |",
        "|---|---|---|---|",
    ]
    rows = []
    for name, purpose in DEPENDENCIES.items():
        package = canonicalize_name(name)
        with_mb = environment.mb(base - environment.needed("framerunner", without=package))
        rows.append((with_mb, f"| {name} | {environment.mb([package]):.1f} | {with_mb:.1f} | {purpose} |"))
    lines += [row for _, row in sorted(rows, reverse=True)]
    lines += ["", "| extra | adds MB | packages | for |", "|---|---|---|---|"]
    for extra, purpose in EXTRAS.items():
        added = environment.needed(f"framerunner[{extra}]") - base
        size = "not for this Python" if extra in missing else f"{environment.mb(added):.0f}"
        lines.append(f"| `{extra}` | {size} | {len(added)} | {purpose} |")
    return "\n".join(lines)


def write(text: str) -> None:
    """Put the tables into the document."""
    document = DOCUMENT.read_text(encoding="utf-8")
    pattern = re.compile(f"{re.escape(BEGIN)}.*{re.escape(END)}", re.DOTALL)
    DOCUMENT.write_text(pattern.sub(lambda _: f"{BEGIN}\n{text}\n{END}", document), encoding="utf-8")


def this_python() -> Path:
    """The Python whose environments are measured: markers are evaluated in it."""
    return Path(sys.executable)
