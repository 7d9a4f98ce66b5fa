"""Asks the package registry whether a Raspberry Pi can install a lock file without a compiler.

`make check-pi` runs it. pip chooses the files as it would on the Pi, with the locked hashes, but installs
nothing. Markers are evaluated here, because pip evaluates them for the Python that runs it.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

_ENTRY = re.compile(
    r"^(?P<requirement>[A-Za-z0-9][^\\\n]*?) \\\n(?P<hashes>(?:    --hash=.*\n)+)", re.MULTILINE
)
_NONE_FITS = re.compile(r"No matching distribution found for ([A-Za-z0-9._-]+)")
_OLDEST_GLIBC_MINOR = 17  # of manylinux wheels for this processor


@dataclass(frozen=True, slots=True)
class System:
    """An operating system for a Raspberry Pi: its name, Python and the minor version of glibc 2."""

    name: str
    python: str
    glibc_minor: int

    @property
    def markers(self) -> dict[str, str]:
        """The values of environment markers (PEP 508) there."""
        return {
            "implementation_name": "cpython",
            "os_name": "posix",
            "platform_machine": "aarch64",
            "platform_python_implementation": "CPython",
            "platform_system": "Linux",
            "python_full_version": f"{self.python}.0",
            "python_version": self.python,
            "sys_platform": "linux",
        }

    @property
    def options(self) -> list[str]:
        """pip's options that choose wheels for it."""
        newest_first = range(self.glibc_minor, _OLDEST_GLIBC_MINOR - 1, -1)
        platforms = [*(f"manylinux_2_{minor}_aarch64" for minor in newest_first), "manylinux2014_aarch64"]
        abis = (f"cp{self.python.replace('.', '')}", "abi3", "none")
        return [
            *("--python-version", self.python, "--implementation", "cp"),
            *(option for abi in abis for option in ("--abi", abi)),
            *(option for platform in platforms for option in ("--platform", platform)),
        ]


SYSTEMS = (
    System("Raspberry Pi OS 12 (bookworm)", "3.11", 36),
    System("Raspberry Pi OS 13 (trixie)", "3.13", 41),
)


def requirements_on(lock: str, system: System) -> dict[str, str]:
    """What a lock file, with hashes, installs on a system: by name, lines for pip without markers."""
    chosen: dict[str, str] = {}
    for entry in _ENTRY.finditer(lock):
        requirement = Requirement(entry["requirement"])
        if requirement.marker is None or requirement.marker.evaluate(dict(system.markers)):
            chosen[requirement.name] = f"{requirement.name}{requirement.specifier} \\\n{entry['hashes']}"
    return chosen


def main(path: Path) -> int:
    """Check a lock file for all systems and print what was found; 1 if a package has no wheel."""
    failed = False
    for system in SYSTEMS:
        requirements = requirements_on(path.read_text(encoding="utf-8"), system)
        found, missing = _find_wheels(requirements, system)
        compiled = sum("aarch64" in wheel for wheel in found)
        print(
            f"{path.name} on {system.name}, 64 bits, Python {system.python}: {len(found)} of "
            f"{len(requirements)} packages have wheels, {compiled} of them compiled for aarch64"
        )
        for name in missing:
            print(f"  {name} has none: pip would need a compiler")
        failed = failed or bool(missing)
    return 1 if failed else 0


def _find_wheels(requirements: dict[str, str], system: System) -> tuple[list[str], list[str]]:
    """The names of the wheels that pip would install, and the packages without one."""
    wanted, missing = dict(requirements), []
    with TemporaryDirectory() as folder:
        listed, report = Path(folder, "requirements.txt"), Path(folder, "report.json")
        while True:
            listed.write_text("".join(wanted.values()), encoding="utf-8")
            command = [
                *(sys.executable, "-m", "pip", "install", "--dry-run", "--quiet", "--only-binary=:all:"),
                *("--no-deps", "--ignore-installed", "--require-hashes", "--target", folder),
                # It would be compared with the Python that runs pip; it is checked below.
                "--ignore-requires-python",
                *system.options,
                *("--requirement", str(listed), "--report", str(report)),
            ]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode == 0:
                break
            unavailable = _NONE_FITS.search(done.stderr)
            if unavailable is None:
                raise SystemExit(done.stderr.strip().splitlines()[-1])
            name = next(each for each in wanted if unavailable[1].startswith(each))
            missing.append(name)
            del wanted[name]
        installed = json.loads(report.read_text(encoding="utf-8"))["install"]
    for each in installed:
        if system.python not in SpecifierSet(each["metadata"].get("requires_python", "")):
            missing.append(each["metadata"]["name"])
    names = [each["download_info"]["url"].rpartition("/")[2] for each in installed]
    return names, missing


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
