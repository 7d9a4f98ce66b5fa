"""COMMAND_LONG and its COMMAND_ACK: asked again when nobody answers, and never mixed up."""

from __future__ import annotations

import asyncio
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field

from pymavlink.dialects.v20 import common as mavlink

from monitor.ports import Message

OWN_SYSTEM = 250
_ANSWER_S = 0.5
_TRIES = 3
_PROGRESS_S = 5.0  # so long a vehicle may say "in progress" once more

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
        filled = (*parameters, *([0.0] * (7 - len(parameters))))
        try:
            for confirmation in range(_TRIES):
                self._send(
                    mavlink.MAVLink_command_long_message(
                        self._system, mavlink.MAV_COMP_ID_AUTOPILOT1, number, confirmation, *filled
                    )
                )
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
