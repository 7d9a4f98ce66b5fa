"""Options of flights with a drone that may be a real one."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from framerunner.commands import check_range
from framerunner.commands.options.flight import HARDWARE_GROUP
from framerunner.commands.options.rules import Given, OptionRule, for_each, given_in, names_of
from framerunner.preflight.settings import DRY_RUN_S, HardwareSettings

if TYPE_CHECKING:
    from offboard.limits import Caps
    from scenarios.models import Scenario


HardwareOptions = Annotated[HardwareSettings, Parameter(name="*", group=HARDWARE_GROUP)]
NONE = HardwareSettings()
CAPS = ("max-speed", "max-height")
_PROCEDURE = tuple(name for name in names_of(HardwareSettings) if name not in (*CAPS, "simulated"))
HARDWARE_RULES = (
    *for_each((*_PROCEDURE, "simulated"), "is for a drone given by --drone; leave it out", needs=("drone",)),
    *for_each(
        ("yes", "simulated"),
        "a service never flies without an operator's go; leave it out",
        excludes=("service",),
    ),
    *for_each(
        _PROCEDURE,
        "a drone that is --simulated is not checked; leave one of them out",
        excludes=("simulated",),
    ),
    OptionRule("hold-time", "is for --on-abort hold; leave it out", needs=("on-abort hold",)),
)
SERVICE_VARIABLE = "FRAMERUNNER_SERVICE"
"""Set by systemd/framerunner-fly.service: nobody may be near the drone when a service starts."""


def given_hardware(options: HardwareSettings) -> Given:
    """The options that are given; "service" among them if a service flies."""
    service = {"service": True} if os.environ.get(SERVICE_VARIABLE) else {}
    return {**given_in(options), **service}


def caps_of(options: HardwareSettings, drone: str | None) -> Caps | None:
    """The caps of a flight; None for a simulated drone without a given one. Raises SettingError."""
    from offboard.limits import Caps

    check_range("--max-speed", options.max_speed, 0.1, 20.0)
    check_range("--max-height", options.max_height, 0.3, 100.0)
    if not options.capped and (drone is None or options.simulated):
        return None
    default = Caps()
    speed_m_s = default.level_m_s if options.max_speed is None else options.max_speed
    vertical_m_s = min(default.vertical_m_s, speed_m_s)
    return Caps(speed_m_s, vertical_m_s, default.yaw_rate_rad_s, options.max_height)


def hardware_of(options: HardwareSettings, drone: str | None) -> HardwareSettings | None:
    """The procedure of a flight; None for a simulated drone. Raises SettingError.

    The options comply with `HARDWARE_RULES`.
    """
    if drone is None or options.simulated:
        return None
    check_range("--hold-time", options.hold_time, 5.0, 100.0)
    if options.accept:
        from framerunner.preflight.check_names import CHECK_NAMES
        from offboard.safety.check import check_names

        check_names(options.accept, CHECK_NAMES)
    return options


def with_dry_limit(scenario: Scenario, options: HardwareSettings) -> Scenario:
    """The scenario with the short time limit of a dry run, if it is one."""
    if not options.dry_run:
        return scenario
    return scenario.model_copy(update={"try_limit_s": min(DRY_RUN_S, scenario.try_limit_s)})
