"""The drone's true state, for the program that started the simulator.

It is told over a socket that the simulator inherits, so no app and no other program can ask for it. The
simulator sends a line once it is up; then it answers each line with the true state, one JSON object a line.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from pydantic import TypeAdapter

from scenarios.models import TrueState
from sitl.pacing.time_grants import ProgramChannel

_STATES = TypeAdapter(TrueState)


def parse_truth(line: bytes) -> TrueState:
    """The state that an answer tells."""
    return _STATES.validate_json(line)


class TruthChannel(ProgramChannel):
    """The simulator's end of the channel."""

    async def open(self, truth: Callable[[], TrueState]) -> None:
        """Report that the simulator is up, and answer from now on with what `truth` returns."""

        async def answer(reader: asyncio.StreamReader) -> None:
            while await reader.readline():
                assert self._writer is not None, "it is open"
                self._writer.write(_STATES.dump_json(truth()) + b"\n")

        await self._open(answer)
