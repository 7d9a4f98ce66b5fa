"""Carries a session over a link, for a thread that waits for its answers."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, Message, mavlink
from framerunner.wire.session.record import Record
from framerunner.wire.session.session import (
    ANSWER_S,
    ParameterValue,
    Request,
    VehicleError,
)
from framerunner.wire.transports.vehicle_link import VehicleLink
from framerunner.wire.vehicle_identity import is_simulator, vehicle_uid

FIND_S = 10.0
TIME_REQUESTS = 20
_TURN_S = 0.01
_TIME_PERIOD_S = 0.05
_HEARTBEATS_S = 1.2  # in which each vehicle sends one
_SAME = 1e-6  # of a value that was set and read back, relative

T = TypeVar("T")
Progress = Callable[[str, float], None]
"""Called with what is being done and how far it is, 0 to 1. What it raises ends all waiting."""


class VehicleClient:
    """A session and the link to its vehicle.

    Args:
        link: open; used by the thread that calls this.
        session: of the vehicle.
        clock: monotonic wall time, seconds.
        progress: see `Progress`.
    """

    def __init__(
        self,
        link: VehicleLink,
        session: Record,
        clock: Callable[[], float],
        progress: Progress = lambda _what, _share: None,
    ) -> None:
        self.link, self.session, self.clock, self.progress = link, session, clock, progress

    def find(self) -> None:
        """Wait for a vehicle's heartbeat. Raises `VehicleError` if none is heard."""
        self.run(FIND_S, "looking for a vehicle", lambda: self.session.system_id is not None)
        if self.session.system_id is None:
            raise VehicleError(
                f"no vehicle was heard on {self.link.url} within {FIND_S:g} s; "
                "is it running and sending to this address?"
            )

    def run(self, limit_s: float, what: str = "", ends: Callable[[], bool] = lambda: False) -> None:
        """Receive and send until a condition holds, or for a time."""
        began_s = self.clock()
        while (now_s := self.clock()) - began_s < limit_s and not ends():
            self.progress(what, (now_s - began_s) / limit_s)
            self.turn()

    def turn(self) -> None:
        """Send what is due, and take what was received, for which it waits a moment."""
        for message in self.session.due(self.clock()):
            self.link.send(message)
        messages = self.link.receive(_TURN_S)
        now_s = self.clock()
        for message in messages:
            self.session.take(message, now_s)

    def answer(self, request: Request[T]) -> T | None:
        """Wait until a request of the session is over; its answer."""
        while not request.over:
            self.progress("", 0.0)
            self.turn()
        return request.answer

    def identity(self) -> tuple[str, bool]:
        """The number of its hardware, or ""; whether it says that it is framerunner's simulated drone."""
        version = self.answer(self.session.message(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION, tries=3))
        if version is None:
            return "", False
        return vehicle_uid(version), is_simulator(version.uid, self.session.vehicle)

    def read_parameters(self, names: list[str]) -> dict[str, ParameterValue]:
        """Read parameters; those that the vehicle does not answer for are left out."""
        found = {name: self.answer(self.session.parameter(name)) for name in names}
        return {name: value for name, value in found.items() if value is not None}

    def set_parameter(self, parameter: ParameterValue) -> None:
        """Set a parameter and read it back.

        Raises:
            VehicleError: the vehicle does not answer, or keeps another value.
        """
        name, wanted = parameter.name, parameter.value
        answered = self.answer(self.session.set_parameter(parameter))
        kept = self.answer(self.session.parameter(name))
        if answered is None or kept is None:
            raise VehicleError(f"{name}: the vehicle did not answer; check the link, then try again")
        if abs(kept.value - wanted) > _SAME * max(1.0, abs(wanted)):
            raise VehicleError(f"{name}: was set to {wanted:g}, but the vehicle keeps {kept.value:g}")

    def round_trips_s(self) -> tuple[float, ...]:
        """Measure the time from a request to its answer with TIMESYNC, `TIME_REQUESTS` times."""
        found: list[float] = []
        for _ in range(TIME_REQUESTS):
            sent_s = self.clock()
            stamp = round(sent_s * 1e9)

            def answer(message: Message, sent_s: float = sent_s, stamp: int = stamp) -> bool | None:
                if message.get_type() != "TIMESYNC" or message.tc1 == 0 or message.ts1 != stamp:
                    return None
                found.append(self.clock() - sent_s)
                return True

            message = mavlink.MAVLink_timesync_message(0, stamp)
            self.session.request(message, answer, tries=1)
            self.run(_TIME_PERIOD_S)
        self.run(ANSWER_S)
        return tuple(found)

    def is_alone(self) -> bool:
        """Whether no other vehicle with the same id is heard until each has sent a heartbeat."""
        self.run(_HEARTBEATS_S)
        addresses = self.link.addresses(self.session.vehicle, AUTOPILOT_COMPONENT_ID)
        return len(addresses) <= 1 and not self.session.senders.problem
