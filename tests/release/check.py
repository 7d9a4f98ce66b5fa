"""Checks a release: builds it, installs it as users do, flies, and runs the examples.

`make release-check` runs it. It needs the package registry, some minutes for each Python, and the ports of a
simulator; it changes nothing in the repository and leaves nothing behind. With `--sizes`, which is
`make release-sizes`, it measures what each dependency and each extra adds, for docs/installation.md.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import venv
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.release import sizes
from tests.release.artefacts import Artefacts, build, metadata_defects, sdist_defects, wheel_defects
from tests.release.run_installed import Installed, python_versions

PYTHONS = ("3.11", "3.12", "3.13", "3.14")
# What the registry would refuse: unknown classifiers, and a readme that cannot be shown.
TOOLS = ("twine>=6,<8", "trove-classifiers")
UNKNOWN_CLASSIFIERS = """\
import sys
from trove_classifiers import classifiers
print([each for each in sys.argv[1:] if each not in classifiers])
"""


def main() -> int:
    """Check what was asked for; 1 if something is wrong."""
    parser = argparse.ArgumentParser(description="Check a release.")
    parser.add_argument("--sizes", action="store_true", help="measure dependencies and extras instead")
    parser.add_argument("--python", action="append", metavar="3.N", help="only with this Python; repeatable")
    chosen = parser.parse_args()
    with TemporaryDirectory(prefix="framerunner-release-") as name:
        folder = Path(name)
        say("building sdist and wheel")
        artefacts = build(folder)
        if chosen.sizes:
            installed = Installed(sizes.this_python(), folder / "sizes", artefacts.wheel)
            sizes.write(sizes.measure(installed))
            say(f"written to {sizes.DOCUMENT.relative_to(Path.cwd())}")
            return 0
        return _check(artefacts, folder, tuple(chosen.python or PYTHONS))


def _check(artefacts: Artefacts, folder: Path, versions: tuple[str, ...]) -> int:
    defects = [
        *wheel_defects(artefacts.wheel),
        *sdist_defects(artefacts.sdist),
        *metadata_defects(artefacts.wheel),
        *_registry_defects(artefacts, folder / "tools"),
    ]
    for path in (artefacts.sdist, artefacts.wheel):
        say(f"  {path.name}: {path.stat().st_size / 1e6:.2f} MB")
    for defect in defects:
        say(f"  {defect}")
    good = not defects
    rows: dict[str, dict[str, str]] = {}
    for version, python in python_versions(versions).items():
        if python is None:
            say(f"Python {version}: not at hand, skipped")
            rows[version] = {}
            continue
        say(f"Python {version}: {python}")
        installed = Installed(python, folder / f"python{version}", artefacts.wheel)
        good = installed.check(say) and good
        rows[version] = installed.steps
    _print_summary(rows, defects)
    if all(not steps for steps in rows.values()):
        say("no Python was at hand")
        return 1
    return 0 if good else 1


def _registry_defects(artefacts: Artefacts, folder: Path) -> list[str]:
    """What the registry would refuse, by its own tools in an environment of their own."""
    say("asking twine")
    venv.create(folder, with_pip=True)
    python = str(folder / "bin" / "python")
    install = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *TOOLS]
    subprocess.run(install, check=True, stderr=subprocess.DEVNULL)
    checked = [python, "-m", "twine", "check", "--strict", str(artefacts.sdist), str(artefacts.wheel)]
    done = subprocess.run(checked, capture_output=True, text=True, check=False)
    defects = [f"twine: {done.stdout}{done.stderr}"] if done.returncode else []
    command = [python, "-c", UNKNOWN_CLASSIFIERS, *sizes.PROJECT["classifiers"]]
    unknown = subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    return defects if unknown == "[]" else [*defects, f"unknown classifiers: {unknown}"]


def _print_summary(rows: dict[str, dict[str, str]], defects: list[str]) -> None:
    names = list(dict.fromkeys(name for steps in rows.values() for name in steps))
    say("\n" + "".join(f"{each:>13}" for each in ["", *names]))
    for version, steps in rows.items():
        shown = [steps.get(name, "-") for name in names] if steps else ["not at hand"]
        say("".join(f"{each:>13}" for each in [f"Python {version}", *shown]))
    say(f"contents, metadata and size: {'as they should be' if not defects else f'{len(defects)} defects'}")


def say(line: str) -> None:
    """Print a line at once."""
    print(line, flush=True)


if __name__ == "__main__":
    sys.exit(main())
