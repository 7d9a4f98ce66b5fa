"""Simulated time that waits for the program that started the simulator, and the camera's images for it.

That program grants time, as in co-simulation (IEEE 1516: time advance request and grant): a grant names the
last control tick that may run, and the setpoint that must have arrived before time advances. The simulator
reports when it holds there, and which image it has sent. So on a busy machine simulated time becomes slower,
and what the program receives at each tick stays the same.

One JSON object a line, over a socket that the simulator inherits; the raw pixels follow the line of an image.
After the socket has closed, time advances freely.
"""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Callable, Coroutine
from dataclasses import asdict, dataclass

import numpy as np
import numpy.typing as npt

Image = npt.NDArray[np.uint8]
FREE_US = 1 << 62
_POLL_S = 0.0005
# At least 2 s: a setpoint has a socket of its own, and one that was lost is sent again in 0.05 s.
_POLLS = 4000
_MOST_WAITING_BYTES = 1 << 26  # of images that the program has not read, while time is free

# Forward, right, down in level axes (m/s) and yaw rate (rad/s, clockwise).
Velocity = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class _Sent:
    """What is sent as one line."""

    def line(self) -> bytes:
        """As sent."""
        return json.dumps(asdict(self)).encode() + b"\n"


@dataclass(frozen=True, slots=True)
class Grant(_Sent):
    """How far simulated time may advance."""

    until_us: int  # time of the last control tick that may run
    setpoint: Velocity | None = None  # that the autopilot must have received before; None: none is awaited

    @staticmethod
    def parse(line: bytes) -> Grant:
        """The inverse of `line`."""
        fields = json.loads(line)
        return Grant(**fields | {"setpoint": fields["setpoint"] and tuple(fields["setpoint"])})


@dataclass(frozen=True, slots=True)
class Held(_Sent):
    """The simulator has used up the time that was granted."""

    time_us: int  # of the last control tick that ran
    image_us: int  # time of exposure of the last image that was sent; negative before the first
    setpoint_missed: bool = False  # the setpoint of the last grant was not received in time


@dataclass(frozen=True, slots=True)
class SentImage(_Sent):
    """An image of the camera; its pixels follow this line, `size_bytes` of them."""

    time_us: int  # of its exposure
    height_px: int
    width_px: int

    @property
    def size_bytes(self) -> int:
        """Of the pixels: BGR, row by row."""
        return self.height_px * self.width_px * 3

    def image(self, pixels: bytes) -> Image:
        """The image, shape (height, width, 3), uint8; it cannot be changed."""
        return np.frombuffer(pixels, np.uint8).reshape(self.height_px, self.width_px, 3)


def parse_answer(line: bytes) -> Held | SentImage:
    """What the simulator has sent."""
    fields = json.loads(line)
    return SentImage(**fields) if "width_px" in fields else Held(**fields)


class ProgramChannel:
    """The simulator's end of a channel to the program that started it, which it inherits; both send lines.

    Args:
        channel: connected to that program.
    """

    def __init__(self, channel: socket.socket) -> None:
        self._channel = channel
        self._writer: asyncio.StreamWriter | None = None
        self._task: asyncio.Task[None] | None = None

    async def _open(self, listen: Callable[[asyncio.StreamReader], Coroutine[None, None, None]]) -> None:
        """Report that the simulator is up, and listen from now on."""
        reader, self._writer = await asyncio.open_connection(sock=self._channel)
        self._writer.write(b"up\n")
        self._task = asyncio.create_task(listen(reader), name=type(self).__name__)

    async def close(self) -> None:
        """Stop listening."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)
        if self._writer is not None:
            self._writer.close()


class TimeGrants(ProgramChannel):
    """The simulator's end of the channel.

    Args:
        channel: connected to the program that grants time.

    Attributes:
        until_us: time of the last control tick that may run; `FREE_US` without a limit.
        used: time has been granted, or never will be.
        setpoint: of the last grant, which was sent before it; None: there was none.
    """

    def __init__(self, channel: socket.socket) -> None:
        super().__init__(channel)
        self.until_us = FREE_US
        self.used = False
        self.setpoint: Velocity | None = None
        self._granted = asyncio.Event()
        self._missed = False

    async def open(self) -> None:
        """Report that the simulator is up, and receive grants from now on."""
        await self._open(self._listen)

    async def first(self, timeout_s: float) -> bool:
        """Wait for the first grant; False if there was none within a wall time."""
        try:
            async with asyncio.timeout(timeout_s):
                await self._granted.wait()
        except TimeoutError:
            return False
        return True

    def send_image(self, image: Image, time_us: int) -> None:
        """Send an image, BGR, shape (height, width, 3), uint8, and the time of its exposure.

        While time is free, one that the program does not read in time is left out.
        """
        writer = self._writer
        if writer is None:
            return
        waiting_bytes = writer.transport.get_write_buffer_size()
        if self.until_us == FREE_US and waiting_bytes > _MOST_WAITING_BYTES:
            return
        height_px, width_px = image.shape[:2]
        writer.write(SentImage(time_us, height_px, width_px).line() + image.tobytes())

    async def hold(self, time_us: int, image_us: int, received: Callable[[], Velocity | None]) -> None:
        """Report where simulated time holds (see `Held`), and wait until it may advance.

        `received` returns the velocity setpoint that the autopilot has now, in a link's single precision.
        """
        self._granted.clear()
        wanted = self.setpoint
        # An older one that MAVSDK's thread has sent again may have come after it.
        missed = self._missed or not (wanted is None or wanted == received())
        if self._writer is not None:
            self._writer.write(Held(time_us, image_us, missed).line())
        await self._granted.wait()
        wanted, polls = self.setpoint, 0
        while not (arrived := wanted is None or wanted == received()) and polls < _POLLS:
            polls += 1
            await asyncio.sleep(_POLL_S)
        self._missed = not arrived

    async def _listen(self, reader: asyncio.StreamReader) -> None:
        try:
            async for line in reader:
                grant = Grant.parse(line)
                self.until_us, self.setpoint, self.used = grant.until_us, grant.setpoint, True
                self._granted.set()
        finally:  # the channel has closed
            self.until_us, self.setpoint, self.used = FREE_US, None, True
            self._granted.set()
