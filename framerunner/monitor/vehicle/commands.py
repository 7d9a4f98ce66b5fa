"""Commands to a vehicle: orders, with the telemetry that shows that they are done, and manual control."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from math import isfinite, nan
from typing import NamedTuple, TypeVar

from framerunner.monitor.vehicle.texts import Texts
from framerunner.wire import px4_modes
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.px4_modes import Px4Mode
from framerunner.wire.session.session import Request, Session
from framerunner.wire.vehicle_telemetry import VehicleTelemetry

OWN_SYSTEM = 250
STICKS_HZ = 25.0
_SHOWN_S = 3.0  # wait for telemetry to show what was accepted
_POLL_S = 0.05
_REASON_S = 0.3  # wait after a refusal for a text with its reason
_FORCE = 21196.0

Send = Callable[[Message], None]
T = TypeVar("T")

_RESULTS = {
    mavlink.MAV_RESULT_TEMPORARILY_REJECTED: "refused for now",
    mavlink.MAV_RESULT_DENIED: "refused",
    mavlink.MAV_RESULT_UNSUPPORTED: "not known to this drone",
    mavlink.MAV_RESULT_FAILED: "failed",
    6: "cancelled",  # MAV_RESULT_CANCELLED
}


class Answer(NamedTuple):
    """The outcome of an order: whether it was done, and one line for people."""

    ok: bool
    text: str


@dataclass(frozen=True, slots=True)
class Sticks:
    """Stick deflections, each -1 to 1; limited to that when they are sent.

    Attributes:
        forward: right stick, away from the pilot is positive.
        right: right stick, to the right is positive.
        up: left stick, away from the pilot is positive.
        yaw: left stick, to the right (clockwise from above) is positive.
    """

    forward: float
    right: float
    up: float
    yaw: float


class StickStream:
    """Sends MANUAL_CONTROL to one vehicle at 25 Hz with the latest sticks."""

    def __init__(self, system_id: int, send: Send) -> None:
        self._system = system_id
        self._send = send
        self._sticks: Sticks | None = None
        self._task: asyncio.Task[None] | None = None

    def set(self, sticks: Sticks | None) -> None:
        """Start or update the stream; None stops it."""
        self._sticks = sticks
        if sticks is None and self._task is not None:
            self._task.cancel()
            self._task = None
        elif sticks is not None and (self._task is None or self._task.done()):
            self._task = asyncio.create_task(self._stream())

    async def _stream(self) -> None:
        loop = asyncio.get_running_loop()
        due_s = loop.time()
        while self._sticks is not None:
            self._send(_manual_control(self._system, self._sticks))
            due_s = max(due_s + 1 / STICKS_HZ, loop.time())  # after a delay it does not catch up
            await asyncio.sleep(due_s - loop.time())


def _manual_control(system_id: int, sticks: Sticks) -> Message:
    """MANUAL_CONTROL: -1000 to 1000, up 0 to 1000; a deflection that is not finite counts as centred."""
    forward, right, up, yaw = (
        min(1.0, max(-1.0, value)) if isfinite(value) else 0.0
        for value in (sticks.forward, sticks.right, sticks.up, sticks.yaw)
    )
    return mavlink.MAVLink_manual_control_message(
        system_id, round(1000 * forward), round(1000 * right), round(500 + 500 * up), round(1000 * yaw), 0
    )


@dataclass(frozen=True, slots=True)
class _Step:
    """A command, and whether telemetry shows its effect."""

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


async def answered(request: Request[T], session: Session, send: Send) -> T | None:
    """Send what a session has to send until a request is over; its answer."""
    loop = asyncio.get_running_loop()
    over = asyncio.Event()
    request.on_over = over.set
    try:
        while not request.over:
            for message in session.due(loop.time()):
                send(message)
            with suppress(TimeoutError):
                async with asyncio.timeout_at(max(request.due_s, loop.time() + _POLL_S)):
                    await over.wait()
    finally:
        request.end()  # if this was cancelled
    return request.answer


async def carry_out(what: str, session: Session, send: Send, texts: Texts) -> Answer:
    """Carry out one of `ORDERS` and check that the telemetry, which is updated meanwhile, shows it."""
    telemetry = session.telemetry
    if what not in ORDERS:
        return Answer(False, f"{what!r} is no order; there are {', '.join(sorted(ORDERS))}")
    steps, done = ORDERS[what]
    if what == "take_off" and telemetry.armed and telemetry.landed is False:
        return Answer(False, "it is in the air already")
    if not telemetry.is_px4 and any(step.number != _ARM.number for step in steps):
        text = "this drone does not have PX4's modes; only arming and stopping can be ordered here"
        return Answer(False, text)
    for step in steps:
        problem = await _follow(step, session, send, texts)
        if problem:
            return Answer(False, f"{what.replace('_', ' ')}: {problem}")
    return Answer(True, done)


async def _follow(step: _Step, session: Session, send: Send, texts: Texts) -> str:
    """Take a step. Returns "" or what went wrong."""
    count = texts.warnings
    command = session.command(step.number, *step.parameters, urgent=step.urgent)
    result = await answered(command, session, send)
    accepted = result == mavlink.MAV_RESULT_ACCEPTED
    if (accepted or (step.urgent and result is None)) and await _wait(
        lambda: step.is_done(session.telemetry), _SHOWN_S
    ):
        return ""
    if result is None:
        return "the drone does not answer"
    if accepted:
        problem = "the drone agreed, but its telemetry does not show it"
    else:
        await _wait(lambda: texts.warnings > count, _REASON_S)
        problem = _RESULTS.get(result, f"answered with result {result}")
    reasons = texts.since(count)
    return f"{problem}: {'; '.join(reasons[-2:])}" if reasons else problem


async def _wait(condition: Callable[[], bool], limit_s: float) -> bool:
    """Wait for a condition that received messages fulfil; False after the limit."""
    loop = asyncio.get_running_loop()
    end_s = loop.time() + limit_s
    while not condition():
        if loop.time() >= end_s:
            return False
        await asyncio.sleep(_POLL_S)
    return True
