"""What a person can order: as commands, and how telemetry shows that it is done."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from math import nan
from typing import Protocol

from pymavlink.dialects.v20 import common as mavlink

from monitor.vehicle import modes
from monitor.vehicle.commands import RESULTS, CommandDesk
from monitor.vehicle.condition import Condition

_SHOWN_S = 3.0
_LOOK_S = 0.05
_REASON_S = 0.3  # so long after a refusal its reason may come as a text
_FORCE = 21196.0
_WARNING = 4  # MAV_SEVERITY; what is less grave is no reason for a refusal

Answer = tuple[bool, str]


class Ordered(Protocol):
    """What an order needs of a vehicle."""

    condition: Condition
    desk: CommandDesk

    def texts_since(self, count: int) -> list[str]:
        """Warnings of the autopilot after the first `count` of them."""
        ...

    @property
    def texts_count(self) -> int:
        """Warnings of the autopilot so far."""
        ...


@dataclass(frozen=True, slots=True)
class _Step:
    """A command and what shows that it was followed."""

    number: int
    parameters: tuple[float, ...]
    is_done: Callable[[Condition], bool]
    urgent: bool = False


def _mode(mode: modes.Mode, *also: modes.Mode) -> _Step:
    custom = float(mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED)
    wanted = (mode, *also)
    return _Step(
        mavlink.MAV_CMD_DO_SET_MODE, (custom, float(mode[0]), float(mode[1])), lambda now: now.mode in wanted
    )


def _arming(*parameters: float, armed: bool, urgent: bool = False) -> _Step:
    number = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
    return _Step(number, parameters, lambda now: now.armed is armed, urgent)


_ARM = _arming(1.0, armed=True)
# As QGroundControl: the mode first, then the motors. NaN leaves place, heading and height to the vehicle.
_TAKE_OFF = _Step(
    mavlink.MAV_CMD_NAV_TAKEOFF,
    (-1.0, 0.0, 0.0, nan, nan, nan, nan),
    lambda now: now.mode in (modes.TAKE_OFF, modes.HOLD),
)

ORDERS: dict[str, tuple[tuple[_Step, ...], str]] = {
    "arm": ((_ARM,), "the motors are on"),
    "disarm": ((_arming(0.0, armed=False),), "the motors are off"),
    "stop_motors": ((_arming(0.0, _FORCE, armed=False, urgent=True),), "the motors are stopped"),
    "take_off": ((_TAKE_OFF, _ARM), "it takes off"),
    "land": ((_mode(modes.LAND),), "it lands"),
    "hold": ((_mode(modes.HOLD),), "it holds"),
    "position": ((_mode(modes.POSITION),), "it follows the sticks"),
    "offboard": ((_mode(modes.OFFBOARD),), "it follows the app"),
}


async def carry_out(vehicle: Ordered, what: str) -> Answer:
    """Order something and see that it is done.

    Args:
        vehicle: by which.
        what: one of `ORDERS`.

    Returns:
        Whether telemetry shows it, and one line for people.
    """
    if what not in ORDERS:
        return False, f"{what!r} is no order; there are {', '.join(sorted(ORDERS))}"
    steps, done = ORDERS[what]
    now = vehicle.condition
    if what == "take_off" and now.armed and now.landed is False:
        return False, "it is in the air already"
    if not now.speaks_px4 and any(step.number != mavlink.MAV_CMD_COMPONENT_ARM_DISARM for step in steps):
        return False, "this drone does not speak PX4's modes; only arming and stopping can be ordered here"
    for step in steps:
        problem = await _follow(vehicle, step)
        if problem:
            return False, f"{what.replace('_', ' ')}: {problem}"
    return True, done


async def _follow(vehicle: Ordered, step: _Step) -> str:
    """Take a step; what went wrong, or ""."""
    count = vehicle.texts_count
    result = await vehicle.desk.ask(step.number, *step.parameters, urgent=step.urgent)
    if result == mavlink.MAV_RESULT_ACCEPTED or (step.urgent and result is None):
        if await _wait(lambda: step.is_done(vehicle.condition), _SHOWN_S):
            return ""
        if result is None:
            return "the drone does not answer"
        return _with_reason(
            "the drone agreed, but its telemetry does not show it", vehicle.texts_since(count)
        )
    if result is None:
        return "the drone does not answer"
    await _wait(lambda: vehicle.texts_count > count, _REASON_S)
    return _with_reason(RESULTS.get(result, f"answered with result {result}"), vehicle.texts_since(count))


def _with_reason(problem: str, reasons: list[str]) -> str:
    return f"{problem}: {'; '.join(reasons[-2:])}" if reasons else problem


async def _wait(condition: Callable[[], bool], limit_s: float) -> bool:
    """Wait for a condition that messages bring about; False if it did not come."""
    loop = asyncio.get_running_loop()
    end_s = loop.time() + limit_s
    while not condition():
        if loop.time() >= end_s:
            return False
        await asyncio.sleep(_LOOK_S)
    return True


def is_warning(severity: int) -> bool:
    """Whether a text may be the reason of a refusal."""
    return severity <= _WARNING
