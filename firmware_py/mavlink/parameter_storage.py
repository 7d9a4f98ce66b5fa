"""PREFLIGHT_STORAGE: save the parameters, or give them their defaults again."""

from __future__ import annotations

from firmware_py.mavlink.exchange import Exchange
from firmware_py.status import CommandResult
from wire.dialect import mavlink

_LOAD, _SAVE, _RESET, _RESET_SENSORS, _RESET_ALL = 0, 1, 2, 3, 4  # PREFLIGHT_STORAGE_PARAMETER_ACTION


def preflight_storage(exchange: Exchange, action: float) -> CommandResult:
    """Do what param1 of the command says.

    Args:
        exchange: whose parameters.
        action: 1 save, 2 and 4 reset; 0 (load) and 3 (forget sensor calibrations) need nothing done, as the
            parameters are loaded at start and there are no calibrations.

    Returns:
        TEMPORARILY_REJECTED while armed; FAILED where nothing is saved, with a text that says how it would
        be; DENIED for what is no such action.
    """
    autopilot = exchange.autopilot
    if autopilot.status.armed:
        return CommandResult.TEMPORARILY_REJECTED
    if action in (_RESET, _RESET_ALL):
        autopilot.parameters.reset()
        return CommandResult.ACCEPTED
    if action in (_LOAD, _RESET_SENSORS):
        return CommandResult.ACCEPTED
    if action != _SAVE:
        return CommandResult.DENIED
    if autopilot.parameters.save():
        return CommandResult.ACCEPTED
    autopilot.say(mavlink.MAV_SEVERITY_WARNING, "Parameters are not saved: start it with --parameters FILE")
    return CommandResult.FAILED
