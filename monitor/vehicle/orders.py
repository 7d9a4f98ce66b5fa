"""What a person can order: as commands to the autopilot, and how telemetry shows that it is done."""

from __future__ import annotations

import asyncio
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
from math import nan
from typing import Protocol

from wire import px4_modes
from wire.dialect import Message, command_long, mavlink
from wire.px4_modes import Px4Mode
from wire.vehicle_telemetry import VehicleTelemetry

OWN_SYSTEM = 250
_ANSWER_S = 0.5
_TRIES = 3
_PROGRESS_S = 5.0  # after "in progress" the answer is waited for this long
_SHOWN_S = 3.0
_LOOK_S = 0.05
_REASON_S = 0.3  # after a refusal, within which its reason may come as a text
_FORCE = 21196.0
_WARNING = 4  # MAV_SEVERITY; what is less grave is no reason for a refusal


Send = Callable[[Message], None]

RESULTS = {
    mavlink.MAV_RESULT_TEMPORARILY_REJECTED: "refused for now",
    mavlink.MAV_RESULT_DENIED: "refused",
    mavlink.MAV_RESULT_UNSUPPORTED: "not known to this drone",
    mavlink.MAV_RESULT_FAILED: "failed",
    6: "cancelled",  # MAV_RESULT_CANCELLED
}


@dataclass(slots=True)
class _Asked:
    """A command on its way."""

    answer: asyncio.Future[int] = field(default_factory=lambda: asyncio.get_running_loop().create_future())
    in_progress: bool = False


class CommandDesk:
    """Sends commands to one vehicle's autopilot.

    An acknowledgement names only the command, so of each number one is on its way at a time; the others wait.

    Args:
        system_id: of the vehicle.
        send: puts a message on the link.
    """

    def __init__(self, system_id: int, send: Send) -> None:
        self._system = system_id
        self._send = send
        self._asked: dict[int, _Asked] = {}
        self._turn: defaultdict[int, asyncio.Lock] = defaultdict(asyncio.Lock)  # of our own numbers: few

    async def ask(self, number: int, *parameters: float, urgent: bool = False) -> int | None:
        """Send a command and wait for what the vehicle says.

        Args:
            number: MAV_CMD.
            *parameters: the first ones of seven; the others are 0.
            urgent: does not wait for its turn; who waits for the same number's answer gets none.

        Returns:
            MAV_RESULT; None: no answer.
        """
        if urgent:
            earlier = self._asked.get(number)
            if earlier is not None and not earlier.answer.done():
                earlier.answer.cancel()
            return await self._ask(number, parameters)
        async with self._turn[number]:
            return await self._ask(number, parameters)

    def take(self, message: Message) -> None:
        """Take a COMMAND_ACK of the autopilot."""
        asked = self._asked.get(message.command)
        if asked is None or message.target_system not in (0, OWN_SYSTEM) or asked.answer.done():
            return
        if message.result == mavlink.MAV_RESULT_IN_PROGRESS:
            asked.in_progress = True
        else:
            asked.answer.set_result(message.result)

    async def _ask(self, number: int, parameters: tuple[float, ...]) -> int | None:
        asked = self._asked[number] = _Asked()
        try:
            for confirmation in range(_TRIES):
                self._send(command_long(self._system, number, *parameters, confirmation=confirmation))
                await asyncio.wait([asked.answer], timeout=_ANSWER_S)
                while asked.in_progress and not asked.answer.done():
                    asked.in_progress = False
                    await asyncio.wait([asked.answer], timeout=_PROGRESS_S)
                if asked.answer.done():
                    return None if asked.answer.cancelled() else asked.answer.result()
            return None
        finally:
            if self._asked.get(number) is asked:
                del self._asked[number]


Answer = tuple[bool, str]


class Ordered(Protocol):
    """What an order needs of a vehicle."""

    telemetry: VehicleTelemetry
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
    is_done: Callable[[VehicleTelemetry], bool]
    urgent: bool = False


def _mode(mode: Px4Mode) -> _Step:
    custom = float(mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED)
    return _Step(
        mavlink.MAV_CMD_DO_SET_MODE,
        (custom, float(mode.main), float(mode.sub)),
        lambda now: now.mode is mode,
    )


def _arming(*parameters: float, armed: bool, urgent: bool = False) -> _Step:
    number = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
    return _Step(number, parameters, lambda now: now.armed is armed, urgent)


_ARM = _arming(1.0, armed=True)
# As QGroundControl: the mode first, then the motors. NaN leaves place, heading and height to the vehicle.
_TAKE_OFF = _Step(
    mavlink.MAV_CMD_NAV_TAKEOFF,
    (-1.0, 0.0, 0.0, nan, nan, nan, nan),
    lambda now: now.mode in (px4_modes.TAKEOFF, px4_modes.HOLD),
)

ORDERS: dict[str, tuple[tuple[_Step, ...], str]] = {
    "arm": ((_ARM,), "the motors are on"),
    "disarm": ((_arming(0.0, armed=False),), "the motors are off"),
    "stop_motors": ((_arming(0.0, _FORCE, armed=False, urgent=True),), "the motors are stopped"),
    "take_off": ((_TAKE_OFF, _ARM), "it takes off"),
    "land": ((_mode(px4_modes.LAND),), "it lands"),
    "hold": ((_mode(px4_modes.HOLD),), "it holds"),
    "position": ((_mode(px4_modes.POSITION),), "it follows the sticks"),
    "offboard": ((_mode(px4_modes.OFFBOARD),), "it follows the app"),
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
    now = vehicle.telemetry
    if what == "take_off" and now.armed and now.landed is False:
        return False, "it is in the air already"
    if not now.is_px4 and any(step.number != mavlink.MAV_CMD_COMPONENT_ARM_DISARM for step in steps):
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
        if await _wait(lambda: step.is_done(vehicle.telemetry), _SHOWN_S):
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
