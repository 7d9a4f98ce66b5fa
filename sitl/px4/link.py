"""The TCP connection to PX4: one HIL_ACTUATOR_CONTROLS for each HIL_SENSOR.

PX4 is the client: it tries to connect every half millisecond until somebody listens. Once connected it never
connects again, so it has to be started again after a simulator that ended. Other programs may connect, too:
the first one whose heartbeat says that it is PX4 is PX4.
"""

from __future__ import annotations

import asyncio
import select
import socket
import time
from collections.abc import Callable
from contextlib import suppress

from framerunner.wire.dialect import mavlink
from framerunner.wire.framing import PacketReader
from framerunner.wire.transports.sockets import Address, Stream, listen_tcp
from framerunner.wire.transports.urls import in_url
from sitl.autopilots import WARNING
from sitl.px4.simulator_messages import ActuatorControls

FIRST_PORT = 4560  # of PX4's instance 0
_SOON_S = 0.004  # for which the event loop waits for an answer; it usually comes in a fraction of this
_SILENCE_S = 2.0  # wall time without an answer that is reported
_ANSWERS_IN_A_ROW = 10  # after which PX4 answers every HIL_SENSOR
_LOOK_S = 0.01  # between two looks whether PX4 has connected
_MAX_CANDIDATES = 16  # connections that may turn out to be PX4's
_STRANGE_S = 3.0  # wall time after which a connection without PX4's heartbeat is reported


class Px4GoneError(Exception):
    """PX4 has closed the connection or ended."""


class _Candidate:
    """A connection of which it is not known yet whether it is PX4's."""

    def __init__(self, connection: socket.socket, peer: Address) -> None:
        self.stream = Stream.of(connection, peer)
        self.place = in_url(*peer[:2])
        self.reader = PacketReader()
        self.since_s = time.monotonic()
        self.is_of_px4 = False
        self.is_reported = False

    def read(self) -> bool:
        """Read what has arrived; whether the connection is still open."""
        try:
            for message in self.reader.feed(self.stream.read() or b""):
                is_heartbeat = message.get_msgId() == mavlink.MAVLINK_MSG_ID_HEARTBEAT
                self.is_of_px4 |= is_heartbeat and message.autopilot == mavlink.MAV_AUTOPILOT_PX4
        except OSError:
            return False
        return True


class Px4Link:
    """Listens for PX4, and then exchanges sensors and outputs with it in lockstep.

    While PX4 starts it does not answer, and its start needs time that goes on: until it has answered ten
    times in a row, nothing waits for its answers.

    Args:
        place: address to listen on.
        notice: called with lines for people.

    Raises:
        LinkError: the port is in use.

    Attributes:
        in_lockstep: every HIL_SENSOR is answered from now on, and `exchange` waits for it.
        steps: HIL_SENSOR messages answered in lockstep.
        unexpected: answers to no HIL_SENSOR, or to one that was answered before, in lockstep.
    """

    def __init__(self, place: Address, notice: Callable[[str], None]) -> None:
        self._listener = listen_tcp(place, "choose another --instance")
        self._notice = notice
        self._stream: Stream | None = None
        self._candidates: list[_Candidate] = []  # the oldest first
        self._reader = PacketReader()
        self._poll = select.poll()
        self._in_a_row = 0
        self.in_lockstep = False
        self.steps = 0
        self.unexpected = 0

    @property
    def is_connected(self) -> bool:
        """Whether PX4 is connected."""
        return self._stream is not None

    async def connected(self) -> None:
        """Wait until PX4 has connected; one that was connected before is let go."""
        self.drop()
        while not self.try_connect():  # noqa: ASYNC110 - one look is at the port and at all connections
            await asyncio.sleep(_LOOK_S)

    def try_connect(self) -> bool:
        """Take PX4's connection if it has one waiting, and close the others."""
        self._accept()
        for candidate in list(self._candidates):
            is_open = candidate.read()
            if candidate.is_of_px4:
                self._candidates.remove(candidate)
                self._close_candidates(0)
                self._take(candidate)
                return True
            if not is_open:
                self._candidates.remove(candidate)
                candidate.stream.close()
            elif not candidate.is_reported and time.monotonic() - candidate.since_s > _STRANGE_S:
                candidate.is_reported = True
                self._notice(
                    f"{WARNING}{candidate.place} is connected to PX4's port and has sent no heartbeat of a "
                    "PX4; PX4 is still waited for"
                )
        return False

    def _accept(self) -> None:
        with suppress(OSError):  # there are no more, or one has gone again
            while True:
                self._candidates.append(_Candidate(*self._listener.accept()))
                self._close_candidates(_MAX_CANDIDATES)

    def _close_candidates(self, left: int) -> None:
        """Close the oldest connections that are not PX4's until so many are left."""
        while len(self._candidates) > left:
            self._candidates.pop(0).stream.close()

    def _take(self, candidate: _Candidate) -> None:
        self.drop()
        self._stream, self._reader = candidate.stream, candidate.reader
        self._poll = select.poll()
        self._poll.register(self._stream, select.POLLIN)
        self._in_a_row = self.steps = self.unexpected = 0
        self.in_lockstep = False

    def drop(self) -> None:
        """Close the connection, if there is one."""
        if self._stream is not None:
            self._stream.close()
            self._stream = None

    def close(self) -> None:
        """Close connection and port."""
        self.drop()
        self._close_candidates(0)
        self._listener.close()

    def send(self, packets: bytes) -> None:
        """Send the messages of a tick."""
        assert self._stream is not None, "connected() comes first"
        self._stream.write(packets)

    def answer(self, time_us: int) -> ActuatorControls | None:
        """PX4's answer to the HIL_SENSOR of this time, waiting for some milliseconds; None if there is none.

        Raises:
            Px4GoneError: the connection has ended.
        """
        deadline_s = time.monotonic() + _SOON_S
        while True:
            left_s = deadline_s - time.monotonic()
            if left_s <= 0.0 or not self._poll.poll(left_s * 1000):
                self._in_a_row = 0
                return None
            found = self._received(time_us)
            if found is not None:
                self._count()
                return found

    async def late_answer(self, time_us: int) -> ActuatorControls:
        """As `answer`, but as long as it takes; others run meanwhile.

        Raises:
            Px4GoneError: the connection has ended.
        """
        assert self._stream is not None, "connected() comes first"
        loop, began_s, silent = asyncio.get_running_loop(), time.monotonic(), False
        readable = asyncio.Event()
        loop.add_reader(self._stream, readable.set)
        try:
            while True:
                found = self._received(time_us)
                if found is not None:
                    self._count()
                    break
                readable.clear()
                try:
                    async with asyncio.timeout(None if silent else _SILENCE_S):
                        await readable.wait()
                except TimeoutError:
                    silent = True
                    self._notice(
                        f"PX4 has not answered for {_SILENCE_S:g} s; simulated time waits for it "
                        f"at {time_us / 1e6:.3f} s"
                    )
        finally:
            with suppress(OSError, ValueError):
                loop.remove_reader(self._stream)
        if silent:
            self._notice(f"PX4 answers again after {time.monotonic() - began_s:.1f} s; nothing was skipped")
        return found

    def _received(self, time_us: int) -> ActuatorControls | None:
        """Read what has arrived; the answer to the HIL_SENSOR of this time, if it is among it."""
        assert self._stream is not None, "connected() comes first"
        try:
            data = self._stream.read()
        except OSError:
            raise Px4GoneError from None
        found = None
        for message in self._reader.feed(data) if data else ():
            controls = ActuatorControls.of(message)
            if controls is None:
                continue
            if controls.time_us == time_us and found is None:
                found = controls
            elif self.in_lockstep:
                self.unexpected += 1
        return found

    def _count(self) -> None:
        if self.in_lockstep:
            self.steps += 1
            return
        self._in_a_row += 1
        self.in_lockstep = self._in_a_row >= _ANSWERS_IN_A_ROW
