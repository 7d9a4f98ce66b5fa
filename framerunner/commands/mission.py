"""`framerunner mission`: the statecharts that fly."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

app = App(name="mission", help="List, show and check missions.")


@app.command(name="list")
def list_() -> int:
    """List the missions that come with the package.

    **Example**

        framerunner mission list
    """
    from offboard.mission import list_missions, load_mission

    for name in list_missions():
        print(f"{name:18s} {load_mission(name).description}")
    return 0


@app.command
def show(mission: Annotated[str, Parameter(help="name or file")]) -> int:
    """Print a mission's diagram in Mermaid's language (paste it into any Markdown page or mermaid.live).

    **Examples**

        framerunner mission show frame_challenge

        framerunner mission show my_mission.yaml > my_mission.mmd
    """
    from offboard.mission import load_mission, mermaid

    print(mermaid(load_mission(mission)))
    return 0


@app.command
def check(file: Annotated[Path, Parameter(help="YAML file")]) -> int:
    """Say whether a mission file is good, or every fault with its line.

    **Example**

        framerunner mission check my_mission.yaml
    """
    from offboard.mission import load_mission

    loaded = load_mission(file)
    print(f"{file}: good, mission '{loaded.name}' with {len(loaded.leaves)} states")
    return 0
