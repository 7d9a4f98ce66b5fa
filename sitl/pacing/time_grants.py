"""Simulated time that waits for the program that started the simulator.

That program grants time, as in co-simulation (IEEE 1516: time advance request and grant): a grant names the
last control tick that may run, and the setpoint that must have arrived before time advances. The simulator
reports when it holds there, and which image it has sent. So on a busy machine simulated time becomes slower,
and what the program receives at each tick stays the same.

One JSON object a line, over a socket that the simulator inherits. Without a grant, and after the socket has
closed, time advances freely.
"""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Callable
from dataclasses import asdict, dataclass

FREE_US = 1 << 62
_POLL_S = 0.0005
# At least 2 s: a setpoint has a socket of its own, and one that was lost is sent again in 0.05 s.
_POLLS = 4000

# Forward, right, down in level axes (m/s) and yaw rate (rad/s, clockwise).
Velocity = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Grant:
    """How far simulated time may advance."""

    until_us: int  # time of the last control tick that may run
    setpoint: Velocity | None = None  # that the autopilot must have received before; None: none is awaited

    def line(self) -> bytes:
        """As sent."""
        return json.dumps(asdict(self)).encode() + b"\n"

    @staticmethod
    def parse(line: bytes) -> Grant:
        """The inverse of `line`."""
        fields = json.loads(line)
        setpoint = fields["setpoint"]
        return Grant(fields["until_us"], None if setpoint is None else tuple(setpoint))


@dataclass(frozen=True, slots=True)
class Held:
    """The simulator has used up the time that was granted."""

    time_us: int  # of the last control tick that ran
    image_us: int  # time of exposure of the last image that was sent; negative before the first
    setpoint_missed: bool = False  # the setpoint of the last grant was not received in time

    def line(self) -> bytes:
        """As sent."""
        return json.dumps(asdict(self)).encode() + b"\n"

    @staticmethod
    def parse(line: bytes) -> Held:
        """The inverse of `line`."""
        return Held(**json.loads(line))


class TimeGrants:
    """The simulator's end of the channel.

    Args:
        channel: connected to the program that grants time.

    Attributes:
        until_us: time of the last control tick that may run; `FREE_US` without a limit.
        used: time has been granted.
    """

    def __init__(self, channel: socket.socket) -> None:
        self.until_us = FREE_US
        self.used = False
        self._channel = channel
        self._setpoint: Velocity | None = None
        self._granted = asyncio.Event()
        self._writer: asyncio.StreamWriter | None = None
        self._task: asyncio.Task[None] | None = None
        self._missed = False

    @property
    def setpoint(self) -> Velocity | None:
        """The setpoint of the last grant, which was sent before it; None: there was none."""
        return self._setpoint

    async def open(self) -> None:
        """Report that the simulator is up, and receive grants from now on."""
        reader, self._writer = await asyncio.open_connection(sock=self._channel)
        self._writer.write(b"up\n")
        self._task = asyncio.create_task(self._listen(reader), name="time grants")

    async def close(self) -> None:
        """Stop receiving grants."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        if self._writer is not None:
            self._writer.close()

    async def hold(self, time_us: int, image_us: int, received: Callable[[], Velocity | None]) -> None:
        """Report where simulated time holds (see `Held`), and wait until it may advance.

        `received` returns the velocity setpoint that the autopilot has now.
        """
        self._granted.clear()
        if self._writer is not None:
            self._writer.write(Held(time_us, image_us, self._missed).line())
        await self._granted.wait()
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
                self.until_us, self._setpoint, self.used = grant.until_us, grant.setpoint, True
                self._granted.set()
        finally:  # the channel has closed
            self.until_us, self._setpoint = FREE_US, None
            self._granted.set()


def _same(wanted: Velocity, received: Velocity | None) -> bool:
    """Whether two setpoints are equal; both have a link's single precision."""
    return received is not None and max(abs(a - b) for a, b in zip(wanted, received, strict=True)) < 1e-7
