"""`framerunner monitor`: drones, missions, tries and replays in a browser."""

from __future__ import annotations

import asyncio
import atexit
import gc
import os
import resource
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from framerunner.commands import NamedPilot, WholeNumber, say, within
from framerunner.commands.options.flight import Lifeline
from framerunner.errors import SettingError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from framerunner.monitor.ports import Equipment
    from scenarios.models import Scenario

MISSIONS = Path("missions")
PUPILS_FILE = "course-pupils.json"  # in the folder of missions
SCENARIOS = (Path("scenarios"),)
DATABASE_FILE = Path("framerunner.db")
DATABASE = f"sqlite:///{DATABASE_FILE}"
_OPEN_FILES = 4096
# By default, half of the time of reading a large mission beside others goes to collecting garbage.
_COLLECT_AFTER = (100_000, 20, 50)
_NICENESS = 5  # beside a flight, which the monitor must not slow down
# The doctor has 247, the virtual camera 246, MAVSDK 245, other ground stations 255.
SYSTEM_ID = 250
COMPONENT_ID = 190  # MAV_COMP_ID_MISSIONPLANNER, as ground stations use it


PagesPort = Annotated[
    WholeNumber, within(0, 65535), Parameter(help="TCP port of the pages; 0 lets the system choose")
]


def monitor(
    *,
    drone: str = "udpin://127.0.0.1:14550",
    scenario: str | None = None,
    bind: str = "127.0.0.1",
    port: PagesPort = 8080,
    database: str = DATABASE,
    runs: Path = Path("runs"),
    missions: Path = MISSIONS,
    scenarios: tuple[Path, ...] = SCENARIOS,
    pilot: NamedPilot = None,
    camera_host: tuple[str, ...] = (),
    trusted_proxy: tuple[str, ...] = (),
    operator_socket: Path | None = None,
    certificate: Path | None = None,
    key: Path | None = None,
    lifeline: Lifeline = False,
) -> int:
    """Open the Game Monitor on http://127.0.0.1:8080/: watch and fly drones, judge tries, replay flights.

    It connects like a ground station and finds camera and referee by itself. Viewers need no log-in.
    Organisers and judges log in with the passwords in FRAMERUNNER_ORGANISER_PASSWORD and
    FRAMERUNNER_JUDGE_PASSWORD or, without one, with the link that is printed; pupils with the code word in
    FRAMERUNNER_CLASS_CODE. Stop it with Ctrl-C.

    **Examples**

        framerunner monitor

        framerunner monitor --bind 0.0.0.0 --certificate monitor.crt --key monitor.key

        framerunner monitor --drone serial:///dev/ttyUSB0:57600 --scenario test-case-1

    Args:
        drone: MAVLink URL: where drones send to ground stations
        scenario: name or file; for a drone without a referee, such as a real one
        bind: address to listen on; 0.0.0.0 lets other machines in
        port: TCP port of the pages.
        database: of teams and tries; SQLAlchemy URL
        runs: folder of recorded flights
        missions: folder that the editor shows
        scenarios: your own scenarios, files or folders: they can be drawn, and their arena is shown
        pilot: primitives of your own.
        camera_host: HOST or HOST:PORT of a camera, if a drone names one that its packets do not come from
        trusted_proxy: address or network of a proxy whose X-Forwarded-For is believed
        operator_socket: local socket at which it listens for flights with an operator (fly --operator-socket)
        certificate: PEM file: serve https:// with it, and the pages' WebSockets as wss://
        key: PEM file of the certificate's private key, if that is not in the same file
        lifeline: stop when standard input ends.
    """
    from framerunner.child_process import until_standard_input_ends
    from framerunner.monitor.run import serve
    from framerunner.monitor.settings import MonitorSettings
    from framerunner.wire.transports.urls import parse_url
    from scenarios.loader import load_scenario

    parse_url(drone)
    flown = None if scenario is None else load_scenario(scenario)
    given = equipment(drone, flown, runs, camera_host, missions=missions, scenarios=scenarios, pilot=pilot)
    settings = MonitorSettings(
        bind,
        port,
        database,
        organiser_password=_secret("ORGANISER_PASSWORD"),
        trusted_proxies=trusted_proxy,
        judge_password=_secret("JUDGE_PASSWORD"),
        class_code=_secret("CLASS_CODE"),
        class_file=missions / PUPILS_FILE,
        qr_codes=_shows_qr_codes(),
        operator_socket=operator_socket,
        certificate=certificate,
        key=key,
    )
    prepare_server()
    os.nice(_NICENESS if lifeline else 0)
    work = serve(given, settings, say)
    asyncio.run(until_standard_input_ends(work) if lifeline else work)
    return 0


def equipment(
    drone_url: str,
    scenario: Scenario | None,
    runs: Path,
    camera_hosts: tuple[str, ...] = (),
    *,
    missions: Path = MISSIONS,
    scenarios: Sequence[Path] = SCENARIOS,
    pilot: str | None = None,
) -> Equipment:
    """What the monitor, which may not import other rooms' functions, is given of them.

    Raises:
        MissionError: the pilot, whose file is executed, cannot be used.
        SettingError: the folder of missions is not there.
    """
    from tempfile import mkdtemp

    from framerunner.course.router import CourseRouter
    from framerunner.editing.documents.router import DocumentsRouter
    from framerunner.editing.documents.session import EditorSession
    from framerunner.editing.live import LiveSettings
    from framerunner.editing.service import EditingSettings
    from framerunner.editing.web import EditingRouter
    from framerunner.flying.plan import FlightPlan
    from framerunner.monitor.ports import Equipment
    from framerunner.monitor.visitors.pupils import PupilBook
    from framerunner.monitoring.run_library import RunFolders
    from framerunner.monitoring.scenario_library import ScenarioLibrary
    from framerunner.wire.transports.vehicle_link import VehicleLink
    from offboard.pilot_file import class_of, find_pilot, pilot_argument

    if missions != MISSIONS and not missions.is_dir():  # the default is made when the first mission is
        raise SettingError(f"--missions {missions}: is not a folder; make it (mkdir -p), or choose another")
    pilot_class = class_of(None if pilot is None else find_pilot(pilot))
    pilot = None if pilot is None else pilot_argument(pilot)
    session = Path(mkdtemp(prefix="framerunner-flights-"))
    atexit.register(shutil.rmtree, session, ignore_errors=True)
    library = ScenarioLibrary(scenarios)
    editing = EditingSettings(pilot, session, live=LiveSettings(drone_url, runs, pilot))
    return Equipment(
        make_referee=lambda flown: FlightPlan(flown).new_referee(),
        open_link=lambda: VehicleLink(drone_url, system_id=SYSTEM_ID, component_id=COMPONENT_ID),
        scenario=scenario,
        list_scenarios=library.names,
        load_scenario=library.load,
        scenario_argument=library.argument,
        runs=RunFolders(runs, session, pilot),
        start_pose=lambda flown: FlightPlan(flown).start_pose,
        camera_hosts=camera_hosts,
        extensions=(
            EditingRouter(editing),
            DocumentsRouter(EditorSession(missions, pilot_class)),
            CourseRouter(missions, pilot, PupilBook(missions / PUPILS_FILE, None)),
        ),
    )


def _secret(what: str) -> str | None:
    """What the environment says of a secret; None: nothing."""
    return os.environ.get(f"FRAMERUNNER_{what}") or None


def prepare_server() -> None:
    """Have this process collect garbage less often, and raise its limit of open files as far as allowed."""
    gc.set_threshold(*_COLLECT_AFTER)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    wanted = _OPEN_FILES if hard == resource.RLIM_INFINITY else min(_OPEN_FILES, hard)
    if soft != resource.RLIM_INFINITY and soft < wanted:
        resource.setrlimit(resource.RLIMIT_NOFILE, (wanted, hard))


def _shows_qr_codes() -> bool:
    return sys.stderr.isatty() and "utf" in (sys.stderr.encoding or "").lower()
