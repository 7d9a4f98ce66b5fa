"""INJECT_FAILURE: break a part on purpose, for tests; only while SYS_FAILURE_EN allows it.

As PX4, it is DENIED while it is not allowed. Unlike PX4, which says nothing to what it cannot break, it is
UNSUPPORTED then.
"""

from __future__ import annotations

from math import floor, isfinite

from firmware_py.mavlink.exchange import Exchange
from firmware_py.status import CommandResult
from wire.dialect import mavlink

_LARGEST = 0xFFFF


def inject_failure(exchange: Exchange, unit: float, kind: float, instance: float) -> CommandResult:
    """Do MAV_CMD_INJECT_FAILURE.

    Args:
        exchange: of the vehicle, with its parameters and who breaks it.
        unit: param 1.
        kind: param 2.
        instance: param 3; NaN: all.

    Returns:
        DENIED while SYS_FAILURE_EN is 0; UNSUPPORTED for what nobody can break; else ACCEPTED, with a text.
    """
    autopilot = exchange.autopilot
    if not autopilot.parameters.value("SYS_FAILURE_EN"):
        return CommandResult.DENIED
    numbers = [_whole(unit), _whole(kind), _whole(instance) if isfinite(instance) else 0]
    if min(numbers) < 0 or exchange.failures is None or not exchange.failures.inject(*numbers):
        return CommandResult.UNSUPPORTED
    what = "mended" if numbers[1] == mavlink.FAILURE_TYPE_OK else f"failure {numbers[1]}"
    autopilot.say(mavlink.MAV_SEVERITY_WARNING, f"Injected: unit {numbers[0]}.{numbers[2]} {what}")
    return CommandResult.ACCEPTED


def _whole(number: float) -> int:
    """A number as PX4 rounds it; -1 for what cannot be one."""
    return floor(number + 0.5) if isfinite(number) and -0.5 <= number <= _LARGEST else -1
