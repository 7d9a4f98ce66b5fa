"""`framerunner monitor`: drones, missions, tries and replays in a browser."""

from __future__ import annotations

import asyncio
import os
import resource
import sys
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from errors import SettingError
from framerunner.commands.options import WholeNumber

PASSWORD_VARIABLE = "FRAMERUNNER_JUDGE_PASSWORD"
DATABASE = "sqlite:///framerunner.db"
_OPEN_FILES = 4096
_NICENESS = 5  # beside a flight: who looks on must not slow it


def monitor(
    *,
    drone: Annotated[
        str, Parameter(help="MAVLink URL: where drones speak to ground stations")
    ] = "udpin://127.0.0.1:14550",
    scenario: Annotated[
        str | None, Parameter(help="name or file; for a drone that brings no referee, as a real one")
    ] = None,
    bind: Annotated[str, Parameter(help="address to listen on; 0.0.0.0 lets others look")] = "127.0.0.1",
    port: Annotated[WholeNumber, Parameter(help="TCP port of the pages; 0 lets the system choose")] = 8080,
    database: Annotated[str, Parameter(help="of teams and tries; SQLAlchemy URL")] = DATABASE,
    runs: Annotated[Path, Parameter(help="folder of flights to show again")] = Path("runs"),
    camera_host: Annotated[
        tuple[str, ...],
        Parameter(
            negative=(),
            help="HOST or HOST:PORT of a camera, if a drone names one that its packets do not come from",
        ),
    ] = (),
    trusted_proxy: Annotated[
        tuple[str, ...],
        Parameter(negative=(), help="address or network of a proxy whose X-Forwarded-For is believed"),
    ] = (),
    lifeline: Annotated[bool, Parameter(show=False, help="stop when standard input ends")] = False,
) -> int:
    """Open the Game Monitor on http://127.0.0.1:8080/: see drones, fly them, judge tries, show flights again.

    It connects like a ground station and finds camera and referee by itself. Judges log in with the password
    in FRAMERUNNER_JUDGE_PASSWORD or, without one, with the link that is printed; onlookers need none. Stop it
    with Ctrl-C.

    **Examples**

        framerunner monitor

        framerunner monitor --bind 0.0.0.0 --port 80

        framerunner monitor --drone serial:///dev/ttyUSB0:57600 --scenario test-case-1
    """
    if not 0 <= port <= 65535:
        raise SettingError(f"--port {port}: must be from 0 to 65535")

    from framerunner.flying.child_process import until_standard_input_ends
    from framerunner.monitoring.equipment import equipment
    from monitor.run import serve
    from monitor.settings import MonitorSettings
    from scenarios.loader import load_scenario
    from wire.transports.urls import parse_url

    parse_url(drone)
    given = equipment(drone, None if scenario is None else load_scenario(scenario), runs, camera_host)
    password, qr_codes = os.environ.get(PASSWORD_VARIABLE) or None, _shows_qr_codes()
    settings = MonitorSettings(bind, port, database, password, trusted_proxy, qr_codes=qr_codes)
    _allow_many_files()
    if lifeline:
        os.nice(_NICENESS)
    work = serve(given, settings, _say)
    asyncio.run(until_standard_input_ends(work) if lifeline else work)
    return 0


def _allow_many_files() -> None:
    """Raise this process's limit of open files, each connection being one, as far as it may."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _OPEN_FILES if hard == resource.RLIM_INFINITY else min(_OPEN_FILES, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


def _shows_qr_codes() -> bool:
    """Whether somebody sits at a terminal that can show them."""
    return sys.stderr.isatty() and "utf" in (sys.stderr.encoding or "").lower()


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
