"""`framerunner edit`: the mission editor in the browser."""

from __future__ import annotations

import asyncio
import contextlib
import webbrowser
from pathlib import Path
from typing import Annotated
from urllib.parse import quote

from cyclopts import Parameter

from framerunner.commands import NamedPilot, say
from framerunner.commands.monitor import PagesPort
from framerunner.errors import SettingError

_SUFFIXES = (".yaml", ".yml")


def edit(
    mission: Path | None = None,
    *,
    source: Annotated[str, Parameter(name="--from")] = "empty",
    pilot: NamedPilot = None,
    drone: str | None = None,
    port: PagesPort = 8090,
    browser: Annotated[bool, Parameter(negative="--no-browser")] = True,
) -> int:
    """Draw and check a mission in the browser: diagram and text side by side. Stop it with Ctrl-C.

    Without MISSION, the page lists the missions of this folder. It is the Game Monitor with its other pages,
    for this machine only.

    **Examples**

        framerunner edit my_mission.yaml

        framerunner edit my_mission.yaml --from frame_challenge

        framerunner edit my_mission.yaml --pilot my_pilot.py

    Args:
        mission: YAML file; one that does not exist is made
        source: what a new one begins as: empty, example, or a mission to copy
        pilot: primitives of your own.
        drone: MAVLink URL: where drones send to ground stations; by default udpin://127.0.0.1:14550, or
            another port if that one is taken
        port: TCP port of the pages.
        browser: open the page in the browser
    """
    from framerunner.commands.monitor import equipment, prepare_server
    from framerunner.editing.documents.session import EditorSession
    from framerunner.monitor.run import serve
    from framerunner.monitor.settings import MonitorSettings

    url = _drone_url(drone)
    folder = Path(".") if mission is None else mission.parent
    path = "edit"
    if mission is not None:
        if mission.suffix not in _SUFFIXES:
            raise SettingError(f"MISSION '{mission}': give a file that ends in .yaml, such as {mission}.yaml")
        if not mission.exists():
            say(f"made: {folder / EditorSession(folder).create(mission.stem, source)}")
        path = f"edit?file={quote(mission.name)}"
    given = equipment(url, None, Path("runs"), missions=folder, pilot=pilot)
    settings = MonitorSettings("127.0.0.1", port, _database())

    def hear(words: str) -> None:
        say(words)
        label, _, url = words.partition(" ")
        if label == "monitor:" and url.startswith("http"):
            say(f"editor: {url}{path}")
            if browser:
                webbrowser.open(f"{url}{path}")

    prepare_server()
    asyncio.run(serve(given, settings, hear))
    return 0


def _database() -> str:
    """The contest's, or one in memory if a monitor uses that: an editor is useful without it."""
    from framerunner.commands.monitor import DATABASE, DATABASE_FILE
    from framerunner.monitor.competition.sole_user import user_of

    with contextlib.suppress(OSError):  # opening the database tells why
        if user := user_of(DATABASE_FILE):
            say(f"{user} uses {DATABASE_FILE}: teams and tries in this editor are not kept")
            return "sqlite://"
    return DATABASE


def _drone_url(given: str | None) -> str:
    """Where drones are heard: as given, or at the port to which they send, or at a free one if that is taken.

    Raises:
        LinkError: the URL is none, or its port is taken.
    """
    from framerunner.child_process import free_port
    from framerunner.editing.live import GROUND_PORT
    from framerunner.wire.transports.sockets import check_free
    from framerunner.wire.transports.urls import LinkError, parse_url

    if given is not None:
        check_free(parse_url(given), "choose another --drone, or leave it out")
        return given
    usual = f"udpin://127.0.0.1:{GROUND_PORT}"
    try:
        check_free(parse_url(usual), "")
    except LinkError:
        port = free_port()
        say(
            f"UDP port {GROUND_PORT} is taken, by a monitor for example, which shows other drones; those "
            f"that are started in the editor are shown here, by port {port}"
        )
        return f"udpin://127.0.0.1:{port}"
    return usual
