"""The drone's true state, for the program that started the simulator.

It is told over a socket that the simulator inherits, so no app and no other program can ask for it. The
simulator sends a line once it is up; then it answers each line with the true state, one JSON object a line.
"""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable

from pydantic import TypeAdapter

from scenarios.models import TrueState

_STATES = TypeAdapter(TrueState)


def parse_truth(line: bytes) -> TrueState:
    """The state that an answer tells."""
    return _STATES.validate_json(line)


class TruthChannel:
    """The simulator's end of the channel.

    Args:
        channel: connected to the program that started the simulator.
    """

    def __init__(self, channel: socket.socket) -> None:
        self._channel = channel
        self._writer: asyncio.StreamWriter | None = None
        self._task: asyncio.Task[None] | None = None

    async def open(self, truth: Callable[[], TrueState]) -> None:
        """Report that the simulator is up, and answer from now on with what `truth` returns."""
        reader, self._writer = await asyncio.open_connection(sock=self._channel)
        self._writer.write(b"up\n")
        self._task = asyncio.create_task(self._answer(reader, self._writer, truth), name="truth")

    async def close(self) -> None:
        """Stop answering."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        if self._writer is not None:
            self._writer.close()

    @staticmethod
    async def _answer(
        reader: asyncio.StreamReader, writer: asyncio.StreamWriter, truth: Callable[[], TrueState]
    ) -> None:
        while await reader.readline():
            writer.write(_STATES.dump_json(truth()) + b"\n")
