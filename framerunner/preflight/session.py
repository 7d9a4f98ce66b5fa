"""Requests and answers on a link to one vehicle, before the app connects."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TypeVar

from framerunner.doctor.listen import COMPONENT_ID, FIND_S, Record, find, listen
from framerunner.wire.dialect import (
    AUTOPILOT_COMPONENT_ID,
    Message,
    companion_heartbeat,
    ground_station_heartbeat,
    mavlink,
    request_message,
)
from framerunner.wire.transports.vehicle_link import VehicleLink
from framerunner.wire.vehicle_identity import is_simulator, vehicle_uid
from offboard.drone import DroneError

SYSTEM_ID = 245
"""MAVSDK's, so the app's: ArduPilot does not arm while it misses the ground station that flew it last."""
ANSWER_S = 0.5
TRIES = 6
TIME_REQUESTS = 20
_TIME_PERIOD_S = 0.05
_LAST_ANSWER_S = 0.5
_HEARTBEAT_S = 1.0
_HEARTBEATS_S = 1.2  # in which each vehicle sends one
_AUTOPILOTS = {mavlink.MAV_AUTOPILOT_PX4: "px4", mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA: "ardupilot"}

T = TypeVar("T")


class VehicleSession:
    """A vehicle that was found on a link.

    To a disarmed vehicle it is a ground station; to an armed one it is not: the vehicle would take the
    session's end for a lost ground station.

    Args:
        link: open; used by the thread that calls this.
        cancelled: set by another thread to end all waiting.

    Attributes:
        record: all that the vehicle has sent.

    Raises:
        DroneError: no vehicle is heard.
    """

    def __init__(self, link: VehicleLink, cancelled: threading.Event | None = None) -> None:
        self.record = Record()
        self._link = link
        self._cancelled = cancelled or threading.Event()
        self._beat_s = -_HEARTBEAT_S
        if not find(link, self.record, self._progress):
            raise DroneError(
                f"no vehicle was heard on {link.url} within {FIND_S:g} s; "
                "is it running and sending to this address?"
            )

    @property
    def system_id(self) -> int:
        """The vehicle's MAVLink system id."""
        assert self.record.system_id is not None, "it was found"
        return self.record.system_id

    @property
    def autopilot(self) -> str:
        """Its autopilot, as the table of failsafes names it: px4, ardupilot, or other."""
        return _AUTOPILOTS.get(self.record.latest["HEARTBEAT"].autopilot, "other")

    @property
    def is_px4(self) -> bool:
        """Its autopilot is PX4, or one that presents itself as PX4."""
        return self.autopilot == "px4"

    @property
    def is_own_simulator(self) -> bool:
        """Whether it says that it is framerunner's simulated drone."""
        version = self._version()
        return version is not None and is_simulator(version.uid, self.system_id)

    @property
    def uid(self) -> str:
        """The unique number of its hardware, as AUTOPILOT_VERSION gives it; empty if it gives none."""
        version = self._version()
        return "" if version is None else vehicle_uid(version)

    def is_alone(self) -> bool:
        """Whether no other vehicle with the same id is heard until each has sent a heartbeat."""
        self.wait(lambda _: None, _HEARTBEATS_S)
        addresses = self._link.addresses(self.system_id, AUTOPILOT_COMPONENT_ID)
        return len(addresses) <= 1 and not self.record.senders.problem

    def _version(self) -> Message | None:
        request = request_message(self.system_id, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        return self.request(
            request, lambda each: each if each.get_type() == "AUTOPILOT_VERSION" else None, tries=3
        )

    def listen(self, seconds: float) -> None:
        """Let the record collect what the doctor requests."""
        listen(self._link, self.record, seconds, self._progress)

    def send(self, message: Message) -> None:
        """Send a message to the vehicle."""
        self._link.send(message)

    def request(
        self, message: Message, answer: Callable[[Message], T | None], tries: int = TRIES
    ) -> T | None:
        """Send a request until it is answered.

        Args:
            message: to send, again every half second.
            answer: what a message of the vehicle's autopilot answers; None if it is another one.
            tries: how often it is sent.

        Returns:
            The answer, or None if there was none.
        """
        for _ in range(tries):
            self.send(message)
            found = self.wait(answer, ANSWER_S)
            if found is not None:
                return found
        return None

    def wait(self, answer: Callable[[Message], T | None], limit_s: float) -> T | None:
        """Wait for a message of the vehicle's autopilot; None after a wall time."""
        end_s = time.monotonic() + limit_s
        while time.monotonic() < end_s:
            for message in self._receive():
                found = answer(message)
                if found is not None:
                    return found
        return None

    def round_trips_s(self) -> tuple[float, ...]:
        """Measure the time from a request to its answer with TIMESYNC, `TIME_REQUESTS` times."""
        found: list[float] = []
        sent: dict[int, float] = {}

        def take(message: Message) -> None:
            if message.get_type() == "TIMESYNC" and message.tc1 != 0 and message.ts1 in sent:
                found.append(time.monotonic() - sent.pop(message.ts1))

        for number in range(TIME_REQUESTS):
            stamp = time.monotonic_ns()
            sent[stamp] = time.monotonic()
            self.send(mavlink.MAVLink_timesync_message(0, stamp))
            self.wait(take, _TIME_PERIOD_S if number < TIME_REQUESTS - 1 else _LAST_ANSWER_S)
        return tuple(found)

    def _receive(self) -> list[Message]:
        """What the vehicle's autopilot has sent by now; waits for a moment if there is nothing."""
        self._progress("", 0.0)
        now_s = time.monotonic()
        if now_s - self._beat_s >= _HEARTBEAT_S:
            self._beat_s = now_s
            self.send(companion_heartbeat() if self.record.armed else ground_station_heartbeat())
        messages = self._link.receive(0.01)
        now_s = time.monotonic()
        for message in messages:
            self.record.take(message, now_s)
        sender = (self.system_id, AUTOPILOT_COMPONENT_ID)
        return [each for each in messages if (each.get_srcSystem(), each.get_srcComponent()) == sender]

    def _progress(self, _what: str, _share: float) -> None:
        if self._cancelled.is_set():
            raise DroneError("interrupted before arming")


def open_link(url: str) -> VehicleLink:
    """A link for a session; the caller closes it."""
    return VehicleLink(url, system_id=SYSTEM_ID, component_id=COMPONENT_ID)
