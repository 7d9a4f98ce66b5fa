"""`framerunner mission`: missions, which are statecharts."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from errors import SettingError
from framerunner.commands import load_mission_with

if TYPE_CHECKING:
    from offboard.mission import NewMission

app = App(name="mission", help="List, show, check and create missions.")

_NAME = re.compile(r"[a-z][a-z0-9_]{0,59}")
PilotOption = Annotated[
    Path | None, Parameter(help="Python file with a subclass of Pilot that the mission uses; it is executed")
]


@app.command(name="list")
def list_() -> int:
    """List the missions that come with the package.

    **Example**

        framerunner mission list
    """
    from offboard.mission import list_missions, load_mission

    for name in list_missions():
        mission = load_mission(name)
        print(f"{name:18s} {mission.description} ({mission.rules})")
    return 0


@app.command
def show(mission: Annotated[str, Parameter(help="name or file")], *, pilot: PilotOption = None) -> int:
    """Print a mission's diagram in Mermaid's language (paste it into any Markdown page or mermaid.live).

    **Examples**

        framerunner mission show explorer

        framerunner mission show my_mission.yaml > my_mission.mmd

        framerunner mission show my_mission.yaml --pilot my_mission.py
    """
    from offboard.mission import mermaid

    print(mermaid(load_mission_with(mission, pilot)))
    return 0


@app.command
def check(file: Annotated[Path, Parameter(help="YAML file")], *, pilot: PilotOption = None) -> int:
    """Say whether a mission file is good, or every fault with its line.

    **Examples**

        framerunner mission check my_mission.yaml

        framerunner mission check my_mission.yaml --pilot my_mission.py
    """
    from offboard.chart.native import load_chart

    loaded = load_mission_with(file, pilot)
    load_chart(loaded.spec, validate=True)
    with_pilot = f" and {pilot}" if pilot is not None else ""
    print(
        f"{file}{with_pilot}: good, mission '{loaded.name}' with {len(loaded.leaves)} states, {loaded.rules}"
    )
    return 0


@app.command
def new(
    name: Annotated[str, Parameter(help="of the mission: small letters, digits and _")],
    *,
    python: Annotated[bool, Parameter(help="with a Python file that adds a primitive of its own")] = False,
    out: Annotated[Path, Parameter(help="folder to write to")] = Path("."),
) -> int:
    """Create a mission: write a small one that flies, with comments that explain it.

    Nothing is ever overwritten.

    **Examples**

        framerunner mission new my_mission

        framerunner mission new my_mission --python --out missions
    """
    from offboard.mission import new_mission

    if not _NAME.fullmatch(name):
        raise SettingError(
            f"NAME '{name}': use small letters, digits and _, a letter first, such as 'my_mission'"
        )
    files = new_mission(name, out, python=python)
    _write(files)
    print(f"written: {', '.join(map(str, files.texts))}\n")
    print(f"  framerunner mission check {files.arguments}")
    print(f"  framerunner fly test-case-1 --lockstep --mission {files.arguments}\n")
    print("The first says whether it is good, the second flies it. The comments in the file explain it.")
    print("It crosses red only, so the referee will judge the flight aborted: add green and blue yourself.")
    return 0


def _write(files: NewMission) -> None:
    """Write all files or, if one of them is there already, none."""
    for path in files.texts:
        if path.exists():
            raise SettingError(f"{path} is there already and is left as it is; choose another NAME or --out")
    path = files.mission.parent
    try:
        path.mkdir(parents=True, exist_ok=True)
        for path, text in files.texts.items():
            with path.open("x", encoding="utf-8") as file:
                file.write(text)
    except OSError as error:
        raise SettingError(f"{path}: cannot be written ({error.strerror}); choose another --out") from None
