"""Options of flights with a drone that may be a real one."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from framerunner.commands import check_range
from framerunner.commands.options.flight import HARDWARE_GROUP
from framerunner.commands.options.rules import Given, Rule, each, given_in, names_of

if TYPE_CHECKING:
    from framerunner.preflight.settings import HardwareSettings
    from offboard.safety.caps import Caps
    from scenarios.models import Scenario


@Parameter(name="*", group=HARDWARE_GROUP)
@dataclass(frozen=True, slots=True)
class HardwareOptions:
    """How a drone that may be a real one is flown.

    Attributes:
        max_speed: cap on the level speed in m/s, whatever the mission asks; with --drone 2 if not given
        max_height: cap on the height above the start in m; the box's ceiling if not given
        dry_run: with --drone, propellers off: checks, camera, mission, setpoints; never arms
        yes: with --drone: checks, but no operator's go; for simulations and CI
        simulated: with --drone: it is a simulation; no checks, no operator, no caps
        set_parameters: with --drone: set failsafe parameters that fail, and keep their old values
        accept: with --drone: fly although the check of this name fails; may be repeated
        on_abort: with --drone: what it does when the flight is aborted
        hold_time: with --on-abort hold: s until it lands, 5 to 100; 30 if not given
        operator_socket: with --drone: socket of a monitor with the operator's page; --monitor has its own
        operator: with --drone: who flies, for the flight card
    """

    max_speed: float | None = None
    max_height: float | None = None
    dry_run: bool = False
    yes: Annotated[bool, Parameter(negative="")] = False
    simulated: Annotated[bool, Parameter(negative="")] = False
    set_parameters: bool = False
    accept: Annotated[tuple[str, ...], Parameter(negative="")] = ()
    on_abort: Literal["land", "hold"] = "land"
    hold_time: float | None = None
    operator_socket: Path | None = None
    operator: str = ""


NONE = HardwareOptions()
CAPS = ("max-speed", "max-height")
_PROCEDURE = tuple(name for name in names_of(HardwareOptions) if name not in (*CAPS, "simulated"))
HARDWARE_RULES = (
    *each((*_PROCEDURE, "simulated"), "is for a drone given by --drone; leave it out", needs=("drone",)),
    *each(
        ("yes", "simulated"),
        "a service never flies without an operator's go; leave it out",
        excludes=("service",),
    ),
    *each(
        _PROCEDURE,
        "a drone that is --simulated is not checked; leave one of them out",
        excludes=("simulated",),
    ),
    Rule("hold-time", "is for --on-abort hold; leave it out", needs=("on-abort hold",)),
)
SERVICE_VARIABLE = "FRAMERUNNER_SERVICE"
"""Set by systemd/framerunner-fly.service: nobody may be near the drone when a service starts."""


def given_hardware(options: HardwareOptions) -> Given:
    """The options that are given; "service" among them if a service flies."""
    service = {"service": True} if os.environ.get(SERVICE_VARIABLE) else {}
    return {**given_in(options), **service}


def caps_of(options: HardwareOptions, drone: str | None) -> Caps | None:
    """The caps of a flight; None for a simulated drone without a given one. Raises SettingError."""
    from offboard.safety.caps import Caps

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
    """The procedure of a flight; None for a simulated drone. Raises SettingError.

    The options comply with `HARDWARE_RULES`.
    """
    from framerunner.preflight.settings import HardwareSettings
    from offboard.safety.rules import HOLD_TIME_S

    if drone is None or options.simulated:
        return None
    check_range("--hold-time", options.hold_time, 5.0, 100.0)
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
