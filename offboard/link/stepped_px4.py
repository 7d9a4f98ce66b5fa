"""PX4's dialect in a simulation whose time waits for this app.

MAVSDK repeats setpoints, and sends requests, on threads of its own, so it depends on the machine at which
simulated time PX4 gets them. Here everything is sent once, while time stands, and time goes on when PX4 has
taken it. So a flight in the same simulation is the same again.
"""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Awaitable, Mapping
from types import MappingProxyType
from typing import Any

from offboard.drone import DroneError, ResponsePrior, VelocityCommand
from offboard.link.commands import synchronous
from offboard.link.dialect import PX4_MODES, TickExchange
from offboard.link.direct import CommandRefusedError, DirectMessages
from wire import px4_modes
from wire.dialect import mavlink
from wire.px4_modes import Px4Mode

ECHO_LIMIT_S = 20.0  # wall time for PX4's answer to a PING, on the busiest machine
_ECHO_AGAIN_S = 0.5  # wall time after which another one is sent
_ANSWER_LIMIT_S = 10.0  # wall time for the answer to a command
_TURNS = 10  # of the event loop, in which what was received before an echo reaches who waits for it
_TAKEN_S = 0.3  # wall time in which PX4 takes a request that it cannot return a PING after
_POSITIONS_HZ = 50.0
_FORCED = 21196.0  # disarming in the air


class _Echo:
    """PINGs that PX4 returns in turn with the other messages that it receives."""

    def __init__(self, messages: DirectMessages, direct: Any) -> None:  # noqa: ANN401
        self._messages = messages
        self._loop = asyncio.get_running_loop()
        self._sequence = 0
        self._echo: asyncio.Future[None] | None = None
        synchronous(direct).subscribe_message("PING", self._on_ping)

    async def wait(self) -> None:
        """Send a PING, and wait until it comes back; PX4 returns it in turn."""
        end_s = time.monotonic() + ECHO_LIMIT_S
        self._sequence += 1
        self._echo = echo = self._loop.create_future()
        while not echo.done():
            if time.monotonic() > end_s:
                raise DroneError(f"link lost: PX4 has not returned a PING for {ECHO_LIMIT_S:g} s")
            self._messages.send_ping(self._sequence)
            await asyncio.wait((echo,), timeout=_ECHO_AGAIN_S)

    def _on_ping(self, message: Any, _user: object) -> None:  # noqa: ANN401
        """On MAVSDK's thread. PX4 sends PINGs of its own, too, to nobody."""
        fields = json.loads(message.fields_json)
        if fields["target_system"]:
            self._loop.call_soon_threadsafe(self._returned, fields["seq"])

    def _returned(self, sequence: int) -> None:
        if self._echo is not None and sequence == self._sequence and not self._echo.done():
            self._echo.set_result(None)


class SteppedPx4Dialect:
    """One PX4, by MAVSDK's plugin `mavlink_direct`; see the module and `Dialect`.

    Requests are sent when a method is called; what it returns waits for the answer.

    Args:
        direct: MAVSDK's asyncio plugin.
        system_id: the vehicle's.
    """

    modes = PX4_MODES
    numbered_modes: Mapping[int, str] = MappingProxyType({})
    response_prior = ResponsePrior.LATE
    checks_in_offboard = False
    ready_limit_s = 30.0

    def __init__(self, direct: Any, system_id: int) -> None:  # noqa: ANN401 - MAVSDK is untyped
        self.ended = False
        self._messages = DirectMessages(direct, system_id)
        self._loop = asyncio.get_running_loop()
        self._command: VelocityCommand | None = None  # the last one; None: the stream has ended
        self._sent_since_tick = False
        self._interval_requested = False  # since the last tick
        self._echo = _Echo(self._messages, direct)
        self._answers: dict[int, asyncio.Future[int]] = {}  # by the number of the command
        synchronous(direct).subscribe_message("COMMAND_ACK", self._on_answer)

    @property
    def exchange(self) -> TickExchange:
        """Itself."""
        return self

    async def before_tick(self) -> None:
        """Wait until PX4 has taken all that was sent; a velocity is sent again if there was no new one."""
        if self._command is not None and not self._sent_since_tick:
            self.send(self._command)
        self._sent_since_tick = False
        if self._interval_requested:
            self._interval_requested = False
            await asyncio.sleep(_TAKEN_S)
        else:
            await self._echo.wait()

    async def after_tick(self) -> None:
        """Wait until all that PX4 has sent has been taken here."""
        await self._echo.wait()
        for _ in range(_TURNS):
            await asyncio.sleep(0)

    def request_streams(self) -> Awaitable[None]:
        """Request positions as often as the app uses them.

        PX4's thread that receives messages waits then, until time has gone on.
        """
        self._interval_requested = True
        interval_us = 1e6 / _POSITIONS_HZ
        number = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
        return self._request(number, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, interval_us)

    def send(self, command: VelocityCommand) -> None:
        """Send a velocity; ignored after `end`."""
        if not self.ended:
            self._command, self._sent_since_tick = command, True
            self._messages.send_velocity(command)

    def repeat(self) -> None:
        """Nothing: `before_tick` does."""

    def request_offboard(self) -> Awaitable[None]:
        """Request the mode that follows setpoints."""
        return self._set_mode(px4_modes.OFFBOARD)

    def request_hold(self) -> Awaitable[None]:
        """End the setpoints until the next one, and request hold."""
        self._command = None
        return self._set_mode(px4_modes.HOLD)

    def request_hold_blocking(self) -> None:
        """The same from a thread, which waits for the answer."""
        self._command = None
        self._messages.command(*_mode_command(px4_modes.HOLD))

    def request_land_blocking(self) -> None:
        """End the setpoints permanently and request landing, from a thread, which waits for the answer."""
        self.end()
        self._messages.command(*_mode_command(px4_modes.LAND))

    def arm(self) -> Awaitable[None]:
        """Arm."""
        return self._request(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)

    def kill(self) -> Awaitable[None]:
        """Disarm at once, in the air too."""
        self._command = None
        return self._request(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0.0, _FORCED)

    def land(self) -> Awaitable[None]:
        """Request landing where the vehicle is."""
        self._command = None
        return self._set_mode(px4_modes.LAND)

    def end(self) -> None:
        """End the setpoints permanently; from any thread."""
        self.ended, self._command = True, None

    def _set_mode(self, mode: Px4Mode) -> Awaitable[None]:
        return self._request(*_mode_command(mode))

    def _request(self, number: int, *parameters: float) -> Awaitable[None]:
        answer: asyncio.Future[int] = self._loop.create_future()
        self._answers[number] = answer
        self._messages.send_command(number, *parameters)
        return _accepted(answer)

    def _on_answer(self, message: Any, _user: object) -> None:  # noqa: ANN401
        fields = json.loads(message.fields_json)
        self._loop.call_soon_threadsafe(self._answered, fields["command"], fields["result"])

    def _answered(self, number: int, result: int) -> None:
        answer = self._answers.get(number)
        if answer is not None and not answer.done() and result != mavlink.MAV_RESULT_IN_PROGRESS:
            answer.set_result(result)


def _mode_command(mode: Px4Mode) -> tuple[int, float, float, float]:
    """Number and parameters of the MAV_CMD that requests a mode."""
    return (mavlink.MAV_CMD_DO_SET_MODE, 1.0, float(mode.main), float(mode.sub))


async def _accepted(answer: asyncio.Future[int]) -> None:
    """Wait for an answer. Raises `CommandRefusedError` if it is another one than "accepted"."""
    try:
        async with asyncio.timeout(_ANSWER_LIMIT_S):
            result = await answer
    except TimeoutError:
        raise CommandRefusedError("TIMEOUT") from None
    if result != mavlink.MAV_RESULT_ACCEPTED:
        raise CommandRefusedError.of(result)
