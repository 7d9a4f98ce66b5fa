"""`framerunner preflight`: the checks before a flight, and the return of parameters after it."""

from __future__ import annotations

import asyncio
import sys
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from framerunner.camera_calibration.camera_delay import delay_of
from framerunner.commands import DEFAULT_MISSION, within
from framerunner.errors import SettingError

if TYPE_CHECKING:
    from framerunner.flying.plan import FlightPlan
    from framerunner.preflight.run import PreflightSettings


def preflight(
    scenario: str = "test-case-1",
    *,
    drone: str = "udpin://0.0.0.0:14540",
    camera: str | None = None,
    camera_delay: Annotated[float | None, within(0.0, 0.5)] = None,
    calibration: Path | None = None,
    mission: str = DEFAULT_MISSION,
    max_speed: float = 2.0,
    max_height: float | None = None,
    set_parameters: Annotated[bool, Parameter(negative="")] = False,
    restore_parameters: Path | None = None,
    any_vehicle: Annotated[bool, Parameter(negative="")] = False,
    accept: Annotated[tuple[str, ...], Parameter(negative="")] = (),
    out: Path = Path(),
) -> int:
    """Check a real drone as `fly` does before it arms it, and write the flight card; nothing is armed.

    The fence of the flight is uploaded and read back. Parameters are changed only with --set-parameters. The
    old fence and old values are kept in a file; --restore-parameters returns them to the vehicle that they
    are of. Each check is a line: result, name, value, what is allowed, what to do.

    Exit code 0: it may be armed, 1: a check has failed, 2: bad input.

    **Examples**

        framerunner preflight --drone serial:///dev/ttyUSB0:921600 --camera 0

        framerunner preflight --set-parameters

        framerunner preflight --restore-parameters parameters-before.params

    Args:
        scenario: name or file of the scenario
        drone: MAVLink URL of the drone
        camera: URL, device or folder of its camera; checked if given
        camera_delay: age in s of an image that arrives without a time stamp; by default the calibration's,
            else 0.1
        calibration: the camera's calibration, a file of `framerunner camera calibrate`
        mission: name or file of the mission
        max_speed: cap on the level speed, m/s
        max_height: cap on the height above the start in m; the box's ceiling if not given
        set_parameters: set failsafe parameters that fail, and keep their old values
        restore_parameters: only return the parameters and the fence of this file, which a check wrote before
        any_vehicle: with --restore-parameters: also to another vehicle than they are of
        accept: name of a check that may fail; may be repeated
        out: folder for the flight card and for old parameters
    """
    if restore_parameters is not None:
        return _restore(drone, restore_parameters, any_vehicle=any_vehicle)
    if any_vehicle:
        raise SettingError("--any-vehicle: is for --restore-parameters; leave it out")

    from framerunner.camera_calibration.calibration_file import load_calibration
    from framerunner.commands.options.hardware import caps_of
    from framerunner.flying.plan import FlightPlan
    from framerunner.preflight.check_names import CHECK_NAMES
    from framerunner.preflight.run import PreflightSettings
    from framerunner.preflight.settings import HardwareSettings
    from offboard.mission import load_mission
    from offboard.safety.check import check_names
    from scenarios.loader import load_scenario

    check_names(accept, CHECK_NAMES)
    caps = caps_of(HardwareSettings(max_speed=max_speed, max_height=max_height), drone)
    loaded = load_mission(mission)
    known = None if calibration is None else load_calibration(calibration)
    plan = FlightPlan(load_scenario(scenario), loaded, None, calibration=known, caps=caps)
    delay = delay_of(camera_delay, known)
    return _check(plan, PreflightSettings(drone, camera, delay, set_parameters, accept, out))


def _check(plan: FlightPlan, settings: PreflightSettings) -> int:
    from framerunner.preflight.card import HTML_NAME, make_card, write_card
    from framerunner.preflight.run import run_preflight, tell
    from offboard.safety.rules import SafetyRules

    report = asyncio.run(run_preflight(plan, settings))
    tell(report)
    now = datetime.now().astimezone()
    card = make_card(
        plan, settings, report, safety=SafetyRules("land"), operator="", kind="checks only", now=now
    )
    write_card(card, settings.folder)
    print(f"flight card: {settings.folder / HTML_NAME}\n{report.verdict}", file=sys.stderr, flush=True)
    return 0 if report.may_arm else 1


def _restore(drone: str, path: Path, *, any_vehicle: bool) -> int:
    from framerunner.preflight.kept import check_vehicle, load_kept, restore
    from framerunner.preflight.link import open_client

    kept = load_kept(path)
    with open_client(drone) as client:
        if not any_vehicle:
            check_vehicle(kept, path, client.identity()[0])
        restore(client, kept, lambda line: print(line, flush=True))
    return 0
