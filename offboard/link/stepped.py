"""What dialects have in common in a simulation whose time waits for this app.

MAVSDK repeats setpoints, and sends requests, on threads of its own, so it depends on the machine at which
simulated time the autopilot gets them. Here everything is sent once, while time stands, and time goes on when
the autopilot has it. So a flight in the same simulation is the same again.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable
from math import inf
from typing import Any

from framerunner.wire.dialect import MAVSDK_SYSTEM_ID, Message, mavlink
from framerunner.wire.session.session import Request, Session
from offboard.drone import DroneError
from offboard.link.dialect import TickExchange
from offboard.link.direct import CommandRefusedError, DirectDialect, DirectMessages, subscribe, synchronous

ECHO_LIMIT_S = 20.0  # wall time for the answer to a PING, on the busiest machine
_ECHO_AGAIN_S = 0.5  # wall time after which another one is sent
_ANSWER_LIMIT_S = 10.0  # wall time for the answer to a command
_TURNS = 10  # of the event loop, in which what was received before an echo reaches who waits for it
_FORCED = 21196.0  # disarming in the air


class _Echo:
    """PINGs that the vehicle returns in turn with the other messages that it receives and sends."""

    def __init__(self, messages: DirectMessages, direct: Any, name: str) -> None:  # noqa: ANN401
        self._messages, self._name = messages, name
        self._loop = asyncio.get_running_loop()
        self._sequence = 0
        self._echo: asyncio.Future[None] | None = None
        subscribe(synchronous(direct), "PING", self._on_ping)

    async def wait(self) -> None:
        """Send a PING, and wait until it comes back."""
        end_s = time.monotonic() + ECHO_LIMIT_S
        self._sequence += 1
        self._echo = echo = self._loop.create_future()
        while not echo.done():
            if time.monotonic() > end_s:
                raise DroneError(f"link lost: {self._name} has not returned a PING for {ECHO_LIMIT_S:g} s")
            self._messages.send(mavlink.MAVLink_ping_message(0, self._sequence, 0, 0))
            await asyncio.wait((echo,), timeout=_ECHO_AGAIN_S)

    def _on_ping(self, message: Message) -> None:
        """On MAVSDK's thread. PX4 sends PINGs of its own, too, to nobody."""
        if message.target_system:
            self._loop.call_soon_threadsafe(self._returned, message.seq)

    def _returned(self, sequence: int) -> None:
        if self._echo is not None and sequence == self._sequence and not self._echo.done():
            self._echo.set_result(None)


class SteppedDialect(DirectDialect):
    """A vehicle, by MAVSDK's plugin `mavlink_direct`; see the module and `Dialect`.

    Requests are sent when a method is called; what it returns waits for the answer.

    Args:
        direct: MAVSDK's asyncio plugin.
        system_id: the vehicle's.
    """

    def __init__(self, direct: Any, system_id: int) -> None:  # noqa: ANN401 - MAVSDK is untyped
        super().__init__(direct, system_id)
        self._echo = _Echo(self._messages, direct, self.kind.name)
        self._session = Session(MAVSDK_SYSTEM_ID, system_id)
        self._loop = asyncio.get_running_loop()
        subscribe(synchronous(direct), "COMMAND_ACK", self._on_answer)

    @property
    def exchange(self) -> TickExchange:
        """Itself."""
        return self

    async def before_tick(self) -> None:
        """Wait until the vehicle has all that was sent; a velocity is sent again if there was no new one."""
        super().repeat()
        await self._until_taken()

    async def after_tick(self) -> None:
        """Wait until all that the vehicle has sent has been taken here."""
        await self._echo.wait()
        for _ in range(_TURNS):
            await asyncio.sleep(0)

    def repeat(self) -> None:
        """Nothing: `before_tick` does."""

    def request_offboard(self) -> Awaitable[None]:
        """Request the mode that follows setpoints."""
        return self._set_mode(self.kind.offboard)

    def request_hold(self) -> Awaitable[None]:
        """End the setpoints until the next one, and request hold."""
        self._command = None
        return self._set_mode(self.kind.hold)

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
        return self._set_mode(self.kind.land)

    async def _until_taken(self) -> None:
        """Wait until the vehicle has all that was sent."""
        await self._echo.wait()

    def _set_mode(self, parameters: tuple[float, ...]) -> Awaitable[None]:
        return self._request(mavlink.MAV_CMD_DO_SET_MODE, *parameters)

    def _on_answer(self, message: Message) -> None:
        """On MAVSDK's thread."""
        self._loop.call_soon_threadsafe(self._session.take, message, time.monotonic())

    def _request(self, number: int, *parameters: float) -> Awaitable[None]:
        """Send a command at once; what is returned waits for the answer, and raises `CommandRefusedError`."""
        over = asyncio.Event()
        request = self._session.command(number, *parameters, urgent=True, tries=1, every_s=inf)
        request.on_over = over.set
        for message in self._session.due(time.monotonic()):
            self._messages.send(message)
        return _accepted(request, over)


async def _accepted(request: Request[int], over: asyncio.Event) -> None:
    """Wait for an answer. Raises `CommandRefusedError` if it is another one than "accepted"."""
    try:
        async with asyncio.timeout(_ANSWER_LIMIT_S):
            await over.wait()
    except TimeoutError:
        request.end()
    if request.answer is None:
        raise CommandRefusedError("TIMEOUT")
    if request.answer != mavlink.MAV_RESULT_ACCEPTED:
        raise CommandRefusedError.of(request.answer)
