"""Options of flights with a drone that may be a real one."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from framerunner.commands import check_range
from framerunner.errors import SettingError

if TYPE_CHECKING:
    from framerunner.preflight.settings import HardwareSettings
    from offboard.limits import Caps
    from scenarios.models import Scenario


@Parameter(name="*")
@dataclass(frozen=True, slots=True)
class HardwareOptions:
    """As the command line gives them."""

    max_speed: Annotated[
        float | None,
        Parameter(
            help="cap on the level speed in m/s, whatever the mission asks; with --drone 2 if not given"
        ),
    ] = None
    max_height: Annotated[
        float | None, Parameter(help="cap on the height above the start in m; the box's ceiling if not given")
    ] = None
    dry_run: Annotated[
        bool, Parameter(help="with --drone, propellers off: checks, camera, mission, setpoints; never arms")
    ] = False
    yes: Annotated[
        bool,
        Parameter(negative="", help="with --drone: checks, but no operator's go; for simulations and CI"),
    ] = False
    simulated: Annotated[
        bool, Parameter(negative="", help="with --drone: it is a simulation; no checks, no operator, no caps")
    ] = False
    set_parameters: Annotated[
        bool, Parameter(help="with --drone: set failsafe parameters that fail, and keep their old values")
    ] = False
    accept: Annotated[
        tuple[str, ...],
        Parameter(
            negative="", help="with --drone: fly although the check of this name fails; may be repeated"
        ),
    ] = ()
    on_abort: Annotated[
        Literal["land", "hold"], Parameter(help="with --drone: what it does when the flight is aborted")
    ] = "land"
    hold_time: Annotated[
        float | None,
        Parameter(help="with --on-abort hold: s until it lands, 5 to 100; 30 if not given"),
    ] = None
    operator_socket: Annotated[
        Path | None,
        Parameter(help="with --drone: socket of a monitor with the operator's page; --monitor has its own"),
    ] = None
    operator: Annotated[str, Parameter(help="with --drone: who flies, for the flight card")] = ""


NONE = HardwareOptions()
SERVICE_VARIABLE = "FRAMERUNNER_SERVICE"
"""Set by systemd/framerunner-fly.service: nobody may be near the drone when a service starts."""


def caps_of(options: HardwareOptions, drone: str | None) -> Caps | None:
    """The caps of a flight; None for a simulated drone without a given one. Raises SettingError."""
    from offboard.limits import Caps

    check_range("--max-speed", options.max_speed, 0.1, 20.0)
    check_range("--max-height", options.max_height, 0.3, 100.0)
    given = options.max_speed is not None or options.max_height is not None
    if not given and (drone is None or options.simulated):
        return None
    default = Caps()
    speed_m_s = default.level_m_s if options.max_speed is None else options.max_speed
    vertical_m_s = min(default.vertical_m_s, speed_m_s)
    return Caps(speed_m_s, vertical_m_s, default.yaw_rate_rad_s, options.max_height)


def hardware_of(options: HardwareOptions, drone: str | None) -> HardwareSettings | None:
    """The procedure of a flight; None for a simulated drone. Raises SettingError."""
    from framerunner.preflight.settings import HardwareSettings
    from offboard.safety.rules import HOLD_TIME_S

    given = {
        "--dry-run": options.dry_run,
        "--yes": options.yes,
        "--set-parameters": options.set_parameters,
        "--accept": bool(options.accept),
        "--on-abort": options.on_abort != NONE.on_abort,
        "--hold-time": options.hold_time is not None,
        "--operator-socket": options.operator_socket is not None,
        "--operator": bool(options.operator),
    }
    used = [name for name, is_given in given.items() if is_given]
    if drone is None:
        used += ["--simulated"] if options.simulated else []
        if used:
            raise SettingError(f"{used[0]}: is for a drone given by --drone; leave it out")
        return None
    if os.environ.get(SERVICE_VARIABLE) and (options.yes or options.simulated):
        name = "--yes" if options.yes else "--simulated"
        raise SettingError(f"{name}: a service never flies without an operator's go; leave it out")
    if options.simulated:
        if used:
            raise SettingError(
                f"{used[0]}: a drone that is --simulated is not checked; leave one of them out"
            )
        return None
    check_range("--hold-time", options.hold_time, 5.0, 100.0)
    if options.hold_time is not None and options.on_abort != "hold":
        raise SettingError("--hold-time: is for --on-abort hold; leave it out")
    if options.accept:
        from framerunner.preflight.check_names import CHECK_NAMES
        from offboard.safety.check import check_names

        check_names(options.accept, CHECK_NAMES)
    return HardwareSettings(
        needs_go=not options.yes,
        abort=options.on_abort,
        hold_s=HOLD_TIME_S if options.hold_time is None else options.hold_time,
        dry_run=options.dry_run,
        set_parameters=options.set_parameters,
        accepted=options.accept,
        operator=options.operator,
        capped=options.max_speed is not None or options.max_height is not None,
        operator_socket=options.operator_socket,
    )


def with_dry_limit(scenario: Scenario, options: HardwareOptions) -> Scenario:
    """The scenario with the short time limit of a dry run, if it is one."""
    from framerunner.preflight.settings import DRY_RUN_S

    if not options.dry_run:
        return scenario
    return scenario.model_copy(update={"try_limit_s": min(DRY_RUN_S, scenario.try_limit_s)})
