"""From a plan to a drone that may be armed: checks, flight card, and the operator at the terminal."""

from __future__ import annotations

import asyncio
import sys
import threading
from collections.abc import Callable
from datetime import datetime

from framerunner.errors import SettingError
from framerunner.flying.plan import FlightPlan
from framerunner.preflight.card import HTML_NAME, FlightCard, make_card, write_card
from framerunner.preflight.keys import HINT, has_terminal
from framerunner.preflight.link import open_client
from framerunner.preflight.run import PreflightSettings, run_preflight, tell
from framerunner.preflight.settings import HardwareSettings
from framerunner.wire.transports.urls import parse_url
from offboard.safety.check import failures
from offboard.safety.operator import Operator
from offboard.safety.rules import SafetyRules
from vision.sources import open_source

PAGE_HINT = "on the monitor's page Operator hold Go, Land lands, then Stop motors stops them"


def check_operator(hardware: HardwareSettings, *, has_page: bool) -> None:
    """Raise SettingError if a go is needed and nobody can give it."""
    if hardware.needs_go and not has_terminal() and not has_page:
        raise SettingError(
            "a real drone is armed only by an operator's key or page, and there is no terminal: start it in "
            "one, or add --monitor; --yes flies without an operator, --simulated says that it is a simulation"
        )


def _check_urls(drone_url: str, camera_url: str | None) -> None:
    parse_url(drone_url)
    if camera_url is not None:
        open_source(camera_url)  # says in a line what can be no camera; it is opened later


async def own_simulator_id(drone_url: str, camera_url: str | None) -> int | None:
    """The MAVLink id of the vehicle on a link if it says that it is framerunner's simulated drone, else None.

    None, too, if another vehicle on the link has the same id: what is sent to one would move both.

    Args:
        drone_url: of the vehicle.
        camera_url: of its camera; checked first, as far as that goes without opening it.

    Raises:
        CameraError: the camera's URL can be no camera.
        LinkError: the address is bad, or the link cannot be opened.
        VehicleError: no vehicle is heard.
    """
    _check_urls(drone_url, camera_url)
    cancelled = threading.Event()

    def ask() -> int | None:
        with open_client(drone_url, cancelled) as client:
            _, is_own_simulator = client.identity()
            return client.session.vehicle if is_own_simulator and client.is_alone() else None

    try:
        return await asyncio.to_thread(ask)
    finally:
        cancelled.set()


def new_operator(hardware: HardwareSettings, *, has_page: bool) -> Operator:
    """The operator of a flight, with how to give the go and to stop.

    Raises:
        SettingError: a go is needed, and there is neither a terminal nor a page.
    """
    check_operator(hardware, has_page=has_page)
    hints = ([HINT] if has_terminal() else []) + ([PAGE_HINT] if has_page else [])
    return Operator(needs_go=hardware.needs_go, hint="; ".join(hints))


async def prepare(
    plan: FlightPlan,
    checks: PreflightSettings,
    hardware: HardwareSettings,
    operator: Operator,
    show: Callable[[FlightCard, tuple[str, ...]], None] = lambda _card, _failed: None,
) -> tuple[SafetyRules, int]:
    """Check the drone and write its flight card.

    Args:
        plan: with a mission.
        checks: what is checked; the card is written into its folder.
        hardware: the procedure.
        operator: of the flight.
        show: called with the card and the names of checks that prevent arming.

    Returns:
        The rules of the flight; the MAVLink id of the drone that was checked.

    Raises:
        LinkError: the drone's address is bad, or its link cannot be opened.
        CameraError: the camera's URL can be no camera.
        NotArmedError: a check has failed that the operator does not accept.
        VehicleError: the vehicle is not heard or does not answer.
        SettingError: a name that is accepted is no check's, or old values cannot be kept.
    """
    _check_urls(checks.drone_url, checks.camera_url)
    print("checks before arming, some ten seconds:", file=sys.stderr, flush=True)
    report = await run_preflight(plan, checks)
    tell(report)
    safety = SafetyRules(hardware.on_abort, operator, hardware.hold_s)
    card = make_card(
        plan,
        checks,
        report,
        safety=safety,
        operator=hardware.operator,
        kind="dry run: nothing is armed" if hardware.dry_run else "flight",
        now=datetime.now().astimezone(),
    )
    write_card(card, checks.folder)
    show(card, tuple(check.name for check in failures(report.checks)))
    print(f"flight card: {checks.folder / HTML_NAME}", file=sys.stderr, flush=True)
    report.require()
    return safety, report.system_id
