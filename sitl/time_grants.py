"""Simulated time that waits for the program that started the simulator.

That program grants time, as in co-simulation (IEEE 1516: time advance request and grant): a grant names the
last control tick that may run, and the setpoint that must have arrived before time goes on. The simulator
says when it holds there, and which image it has sent. So on a busy machine simulated time becomes slower, and
what the program is given at each tick stays the same.

One JSON object a line, over a socket that the simulator inherits. Without a grant, and when the socket
closes, time is free.
"""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Callable
from dataclasses import asdict, dataclass

FREE_US = 1 << 62
_POLL_S = 0.0005
# At least 2 s: a setpoint comes over a socket of its own, and one that was lost is sent again in 0.05 s.
_POLLS = 4000

Velocity = tuple[float, float, float, float]
"""Forward, right, down in level axes (m/s) and yaw rate (rad/s, clockwise)."""


@dataclass(frozen=True, slots=True)
class Grant:
    """How far simulated time may go.

    Attributes:
        until_us: time of the last control tick that may run, microseconds.
        setpoint: the velocity that the autopilot must have received before; None: it need not have any.
    """

    until_us: int
    setpoint: Velocity | None = None

    def line(self) -> bytes:
        """As sent."""
        return json.dumps(asdict(self)).encode() + b"\n"

    @staticmethod
    def parse(line: bytes) -> Grant:
        """Read what `line` made."""
        fields = json.loads(line)
        setpoint = fields["setpoint"]
        return Grant(fields["until_us"], None if setpoint is None else tuple(setpoint))


@dataclass(frozen=True, slots=True)
class Held:
    """The simulator has done what was granted.

    Attributes:
        time_us: of the last control tick that ran, microseconds.
        image_us: time of exposure of the last image that was sent; negative before the first.
        setpoint_missed: the setpoint of the last grant did not come in time.
    """

    time_us: int
    image_us: int
    setpoint_missed: bool = False

    def line(self) -> bytes:
        """As sent."""
        return json.dumps(asdict(self)).encode() + b"\n"

    @staticmethod
    def parse(line: bytes) -> Held:
        """Read what `line` made."""
        return Held(**json.loads(line))


class TimeGrants:
    """The simulator's end.

    Args:
        channel: connected to the program that grants.

    Attributes:
        until_us: time of the last control tick that may run; `FREE_US` while time is free.
    """

    def __init__(self, channel: socket.socket) -> None:
        self.until_us = FREE_US
        self._channel = channel
        self._setpoint: Velocity | None = None
        self._came = asyncio.Event()
        self._writer: asyncio.StreamWriter | None = None
        self._task: asyncio.Task[None] | None = None
        self._missed = False

    async def open(self) -> None:
        """Say that the simulator is up, and listen from now on."""
        reader, self._writer = await asyncio.open_connection(sock=self._channel)
        self._writer.write(b"up\n")
        self._task = asyncio.create_task(self._listen(reader), name="time grants")

    async def close(self) -> None:
        """Listen no more."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        if self._writer is not None:
            self._writer.close()

    async def hold(self, time_us: int, image_us: int, received: Callable[[], Velocity | None]) -> None:
        """Say where simulated time holds, and wait until it may go on.

        Args:
            time_us: of the last control tick that ran.
            image_us: time of exposure of the last image that was sent.
            received: the velocity setpoint that the autopilot has now.
        """
        self._came.clear()  # what was granted is used up
        if self._writer is not None:
            self._writer.write(Held(time_us, image_us, self._missed).line())
        await self._came.wait()
        wanted = self._setpoint
        polls = 0
        while not (arrived := wanted is None or _same(wanted, received())) and polls < _POLLS:
            polls += 1
            await asyncio.sleep(_POLL_S)
        self._missed = not arrived

    async def _listen(self, reader: asyncio.StreamReader) -> None:
        try:
            async for line in reader:
                grant = Grant.parse(line)
                self.until_us, self._setpoint = grant.until_us, grant.setpoint
                self._came.set()
        finally:  # nobody is there to grant
            self.until_us, self._setpoint = FREE_US, None
            self._came.set()


def _same(wanted: Velocity, received: Velocity | None) -> bool:
    """Whether a setpoint is the wanted one; both have a link's single precision."""
    return received is not None and max(abs(a - b) for a, b in zip(wanted, received, strict=True)) < 1e-7
