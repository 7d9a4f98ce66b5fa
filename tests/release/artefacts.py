"""Builds the sdist and the wheel from the files that Git knows, and says what is wrong with them.

Each check returns one line for each defect; an empty list is the good case.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from configparser import ConfigParser
from dataclasses import dataclass
from pathlib import Path

from packaging.metadata import Metadata
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]
PACKAGES = ("framerunner", "sitl", "firmware_py", "offboard", "vision", "scenarios")
IN_THE_SDIST = frozenset({"CHANGELOG.md", "LICENSE", "PKG-INFO", "README.md", "pyproject.toml", "setup.cfg"})
MAX_WHEEL_MB = 3.0
MAX_SDIST_MB = 3.0
ENTRY_POINTS = {
    "console_scripts": {"framerunner": "framerunner.cli:main"},
    "pytest11": {"framerunner": "framerunner.pytest_plugin"},
}


@dataclass(frozen=True, slots=True)
class Artefacts:
    """The files of a release."""

    sdist: Path
    wheel: Path


def tracked_files(*places: str) -> list[str]:
    """The files below some places of the repository that a fresh clone would have, new ones too."""
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "--", *places]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    return sorted({name for name in done.stdout.splitlines() if (ROOT / name).is_file()})


def build(folder: Path) -> Artefacts:
    """Build the sdist, and from it the wheel, with the build requirements that are installed.

    It is built in a copy: what earlier builds left in `build/` would be taken into the wheel.

    Args:
        folder: for the copy; the files are left in its folder `dist`.
    """
    source = folder / "source"
    for name in tracked_files():
        if name.partition("/")[0] not in {"docs", "web"}:  # large; neither is read by the build
            (source / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, source / name)
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder / "dist"), str(source)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"the build failed:\n{done.stdout}{done.stderr}")
    (sdist,) = (folder / "dist").glob("*.tar.gz")
    (wheel,) = (folder / "dist").glob("*.whl")
    return Artefacts(sdist, wheel)


def wheel_defects(wheel: Path) -> list[str]:
    """What the wheel should not have, lacks, or has with other contents than the repository."""
    with zipfile.ZipFile(wheel) as file:
        contents = {name: file.read(name) for name in file.namelist() if not name.endswith("/")}
    shipped = {name: text for name, text in contents.items() if ".dist-info/" not in name}
    wanted = set(tracked_files(*PACKAGES))
    packages = {name.partition("/")[0] for name in shipped}
    defects = [] if packages == set(PACKAGES) else [f"top-level packages: {', '.join(sorted(packages))}"]
    defects += [f"not in the wheel: {name}" for name in sorted(wanted - set(shipped))]
    defects += [f"in the wheel, but not in the repository: {name}" for name in sorted(set(shipped) - wanted)]
    defects += [
        f"in the wheel with other contents: {name}"
        for name in sorted(wanted & set(shipped))
        if shipped[name] != (ROOT / name).read_bytes()
    ]
    return [*defects, *_too_large(wheel, MAX_WHEEL_MB)]


def sdist_defects(sdist: Path) -> list[str]:
    """What the sdist should not have, or lacks."""
    with tarfile.open(sdist) as file:
        names = {each.name.partition("/")[2] for each in file.getmembers() if each.isfile()}
    found = {name for name in names if ".egg-info/" not in name}
    wanted = {*tracked_files(*PACKAGES, "examples"), *IN_THE_SDIST}
    defects = [f"not in the sdist: {name}" for name in sorted(wanted - found)]
    defects += [f"in the sdist without need: {name}" for name in sorted(found - wanted - {"MANIFEST.in"})]
    return [*defects, *_too_large(sdist, MAX_SDIST_MB)]


def metadata_defects(wheel: Path) -> list[str]:
    """What the wheel's metadata says wrongly, compared with `pyproject.toml`."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    with zipfile.ZipFile(wheel) as file:
        folder = next(name for name in file.namelist() if ".dist-info/" in name).partition("/")[0]
        text = file.read(f"{folder}/METADATA")
        points = file.read(f"{folder}/entry_points.txt").decode()
        licence_is_there = f"{folder}/licenses/LICENSE" in file.namelist()
    try:
        metadata = Metadata.from_email(text, validate=True)
    except ExceptionGroup as error:
        return [f"metadata: {each}" for each in error.exceptions]
    wanted = {
        "name": project["name"],
        "version": project["version"],
        "summary": project["description"],
        "license_expression": project["license"],
        "license_files": project["license-files"],
        "requires_python": project["requires-python"],
        "classifiers": project["classifiers"],
        "description_content_type": "text/markdown",
        "description": (ROOT / project["readme"]).read_text(encoding="utf-8"),
        "provides_extra": sorted(project["optional-dependencies"]),
    }
    found = {name: getattr(metadata, name) for name in wanted}
    found["requires_python"] = str(found["requires_python"])
    found["version"] = str(found["version"])
    found["provides_extra"] = sorted(found["provides_extra"] or [])
    defects = [f"metadata: {name} is {found[name]!r:.200}" for name in wanted if found[name] != wanted[name]]
    always = {_named(line) for line in project["dependencies"]}
    required = {each.name for each in metadata.requires_dist or [] if "extra" not in str(each.marker or "")}
    if required != always:
        defects.append(f"metadata: requires {sorted(required)}")
    parser = ConfigParser()
    parser.read_string(points)
    if {name: dict(parser[name]) for name in parser.sections()} != ENTRY_POINTS:
        defects.append(f"entry points: {points!r}")
    return defects if licence_is_there else [*defects, "the licence is not in the wheel"]


def _named(line: str) -> str:
    return Requirement(line).name


def _too_large(path: Path, limit_mb: float) -> list[str]:
    size_mb = path.stat().st_size / 1e6
    return [] if size_mb <= limit_mb else [f"{path.name} has {size_mb:.1f} MB; {limit_mb} MB are the limit"]
