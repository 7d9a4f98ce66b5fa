"""Links over streams of bytes: TCP, as a server and as a client, and serial lines."""

from __future__ import annotations

import asyncio
import os
import termios
import tty
from collections.abc import Callable
from typing import Protocol, cast

from sitl.link_urls import LinkError
from sitl.links import Carrier, Receive

_RETRY_S = 1.0
_MAX_WAITING_BYTES = 1 << 18  # whoever reads slower loses packets, whole ones, as on a radio
_MAX_CLIENTS = 16

Joined = Callable[[Carrier], Receive]  # told of a new connection; gives who takes its bytes
Left = Callable[[Carrier], None]


class StreamLink(asyncio.Protocol):
    """One connection over TCP or a serial line.

    Args:
        joined: called when it stands.
        left: called when it is over.
    """

    def __init__(self, joined: Joined, left: Left) -> None:
        self._joined, self._left = joined, left
        self._receive: Receive | None = None
        self._writer: asyncio.WriteTransport | None = None
        self.over = asyncio.Event()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Join (asyncio calls this)."""
        self.write_to(cast(asyncio.WriteTransport, transport))

    def write_to(self, transport: asyncio.WriteTransport) -> None:
        """Join, with what to write to."""
        self._writer = transport
        self._receive = self._joined(self)

    def data_received(self, data: bytes) -> None:
        """Take bytes (asyncio calls this)."""
        if self._receive is not None:
            self._receive(data)

    def connection_lost(self, exc: Exception | None) -> None:
        """Leave (asyncio calls this)."""
        if self._receive is not None:
            self._receive = None
            self._left(self)
        self.over.set()

    def send(self, data: bytes) -> None:
        """Send whole packets, or lose them when too many wait."""
        writer = self._writer
        if writer is None or writer.is_closing():
            return
        if writer.get_write_buffer_size() + len(data) <= _MAX_WAITING_BYTES:
            writer.write(data)

    def close(self) -> None:
        """Close the connection."""
        if self._writer is not None:
            self._writer.abort()


class Closable(Protocol):
    """What a hub closes at the end."""

    def close(self) -> None:
        """Close it and all connections it made."""
        ...


class TcpServer:
    """Takes TCP clients; each is a connection of its own."""

    def __init__(self, joined: Joined, left: Left) -> None:
        self._joined, self._left = joined, left
        self._server: asyncio.Server | None = None
        self._links: set[StreamLink] = set()

    async def open(self, host: str, port: int) -> None:
        """Listen.

        Raises:
            LinkError: the port is taken or the address is not ours.
        """
        loop = asyncio.get_running_loop()
        try:
            self._server = await loop.create_server(lambda: StreamLink(self._join, self._leave), host, port)
        except OSError as error:
            raise LinkError(
                f"TCP {host}:{port} cannot be listened on ({_reason(error)}); choose another port"
            ) from error

    def _join(self, carrier: Carrier) -> Receive:
        link = cast(StreamLink, carrier)
        if len(self._links) >= _MAX_CLIENTS:
            link.close()
            return lambda data: None
        self._links.add(link)
        return self._joined(link)

    def _leave(self, carrier: Carrier) -> None:
        if isinstance(carrier, StreamLink) and carrier in self._links:
            self._links.discard(carrier)
            self._left(carrier)

    def close(self) -> None:
        """Listen no more and send all clients away."""
        if self._server is not None:
            self._server.close()
        for link in list(self._links):
            link.close()


class TcpClient:
    """Connects to a server, and again a second after it was lost."""

    def __init__(self, host: str, port: int, joined: Joined, left: Left) -> None:
        self._joined, self._left = joined, left
        self._task = asyncio.create_task(self._run(host, port))

    async def _run(self, host: str, port: int) -> None:
        loop = asyncio.get_running_loop()
        while True:
            try:
                _, link = await loop.create_connection(
                    lambda: StreamLink(self._joined, self._left), host, port
                )
            except OSError:
                await asyncio.sleep(_RETRY_S)
                continue
            try:
                await link.over.wait()
            finally:
                link.close()
            await asyncio.sleep(_RETRY_S)

    def close(self) -> None:
        """Hang up and try no more."""
        self._task.cancel()


class SerialLine:
    """A serial line, eight bits, no parity, no flow control."""

    def __init__(self) -> None:
        self._transports: list[asyncio.BaseTransport] = []

    async def open(self, path: str, baud: int, joined: Joined, left: Left) -> None:
        """Open it.

        Raises:
            LinkError: there is no such device, it is no serial line, or the baud rate is none.
        """
        speed = getattr(termios, f"B{baud}", None)
        if not speed:
            raise LinkError(f"serial {path}:{baud}: {baud} is not a usual baud rate, such as 57600 or 921600")
        try:
            line = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise LinkError(
                f"serial {path} cannot be opened ({_reason(error)}); check the device and your rights to it"
            ) from error
        try:
            _make_raw(line, speed)
        except (termios.error, OSError) as error:
            os.close(line)
            raise LinkError(f"serial {path}: this is not a serial line") from error
        loop = asyncio.get_running_loop()
        link = StreamLink(joined, left)
        writing = os.fdopen(os.dup(line), "wb", buffering=0)
        writer, _ = await loop.connect_write_pipe(asyncio.BaseProtocol, writing)
        link.write_to(writer)
        reader, _ = await loop.connect_read_pipe(lambda: _Reading(link), os.fdopen(line, "rb", buffering=0))
        self._transports = [writer, reader]

    def close(self) -> None:
        """Let the line go."""
        for transport in self._transports:
            transport.close()


class _Reading(asyncio.Protocol):
    """The reading half of a serial line."""

    def __init__(self, link: StreamLink) -> None:
        self._link = link

    def data_received(self, data: bytes) -> None:
        self._link.data_received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self._link.connection_lost(exc)


def _make_raw(line: int, speed: int) -> None:
    """Set a terminal to carry bytes as they are."""
    tty.setraw(line, termios.TCSANOW)
    settings = termios.tcgetattr(line)
    settings[2] = (settings[2] | termios.CLOCAL | termios.CREAD) & ~(termios.CSTOPB | termios.CRTSCTS)
    settings[4] = settings[5] = speed
    termios.tcsetattr(line, termios.TCSANOW, settings)


def _reason(error: OSError) -> str:
    """Why, in few words; asyncio's own texts repeat the address."""
    return os.strerror(error.errno) if error.errno and error.errno > 0 else str(error.strerror or error)
