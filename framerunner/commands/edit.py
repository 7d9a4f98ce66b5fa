"""`framerunner edit`: the mission editor in the browser."""

from __future__ import annotations

import asyncio
import webbrowser
from pathlib import Path
from typing import Annotated
from urllib.parse import quote

from cyclopts import Parameter

from errors import SettingError
from framerunner.commands import WholeNumber, check_range, say

_SUFFIXES = (".yaml", ".yml")


def edit(
    mission: Annotated[Path | None, Parameter(help="YAML file; one that does not exist is made")] = None,
    *,
    source: Annotated[
        str, Parameter(name="--from", help="what a new one begins as: empty, example, or a mission to copy")
    ] = "empty",
    drone: Annotated[
        str, Parameter(help="MAVLink URL: where drones send to ground stations")
    ] = "udpin://127.0.0.1:14550",
    port: Annotated[WholeNumber, Parameter(help="TCP port of the pages; 0 lets the system choose")] = 8090,
    browser: Annotated[bool, Parameter(help="open the page in the browser", negative="--no-browser")] = True,
) -> int:
    """Draw and check a mission in the browser: diagram and text side by side. Stop it with Ctrl-C.

    Without MISSION, the page lists the missions of this folder. It is the Game Monitor with its other pages,
    for this machine only.

    **Examples**

        framerunner edit my_mission.yaml

        framerunner edit my_mission.yaml --from frame_challenge
    """
    check_range("--port", port, 0, 65535)
    from framerunner.commands.monitor import DATABASE, equipment
    from framerunner.editing.documents.desk import EditorDesk
    from monitor.run import serve
    from monitor.settings import MonitorSettings
    from wire.transports.urls import parse_url

    parse_url(drone)
    folder = Path(".") if mission is None else mission.parent
    path = "edit"
    if mission is not None:
        if mission.suffix not in _SUFFIXES:
            raise SettingError(f"MISSION '{mission}': give a file that ends in .yaml, such as {mission}.yaml")
        if not mission.exists():
            say(f"made: {folder / EditorDesk(folder).create(mission.stem, source)}")
        path = f"edit?file={quote(mission.name)}"
    given = equipment(drone, None, Path("runs"), missions=folder)
    settings = MonitorSettings("127.0.0.1", port, DATABASE)

    def hear(words: str) -> None:
        say(words)
        label, _, url = words.partition(" ")
        if label == "monitor:" and url.startswith("http"):
            say(f"editor: {url}{path}")
            if browser:
                webbrowser.open(f"{url}{path}")

    asyncio.run(serve(given, settings, hear))
    return 0
