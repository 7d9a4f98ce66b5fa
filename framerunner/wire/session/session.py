"""The session of a client with one vehicle, without clock and link: time is passed in.

The rules of all clients are here: whose answers count, how often a request is sent, and how long an answer is
waited for. `take` gets what was received, `due` returns what is to be sent.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from copy import copy
from dataclasses import dataclass
from functools import partial
from math import inf
from typing import Any, Generic, Literal, TypeVar

from framerunner.errors import UserError
from framerunner.wire.dialect import (
    AUTOPILOT_COMPONENT_ID,
    BROADCAST,
    Message,
    command_long,
    companion_heartbeat,
    ground_station_heartbeat,
    is_vehicle,
    mavlink,
    request_message,
    request_parameter,
    request_rate,
)
from framerunner.wire.vehicle_telemetry import VehicleTelemetry

ANSWER_S = 0.5
TRIES = 6
COMMAND_TRIES = 3
PROGRESS_S = 5.0  # wait for the answer after "in progress"
HEARTBEAT_S = 1.0
_FLOAT = mavlink.MAV_PARAM_TYPE_REAL32
_WHOLE = {mavlink.MAV_PARAM_TYPE_INT32: "<i", mavlink.MAV_PARAM_TYPE_UINT32: "<I"}

Heartbeat = Literal["none", "companion", "ground station"]
"""What a session presents itself as. A ground station is one to a disarmed vehicle only: an armed one would
take the session's end for a lost ground station."""
T = TypeVar("T")


class VehicleError(UserError):
    """The vehicle is not heard, does not answer or refuses; the message is one line for people."""


@dataclass(frozen=True, slots=True)
class Wait:
    """An answer's beginning: for so long nothing is sent again."""

    seconds: float
    is_last: bool = False  # if no more comes in that time, the request is given up


class Request(Generic[T]):
    """A message that is sent until the vehicle's autopilot answers it; see `Session.request`.

    Attributes:
        answer: None: there was none, or not yet.
        over: it was answered or given up.
        due_s: when it is sent again or given up.
        number: MAV_CMD; 0: it is no command.
        on_over: called when it is over.
    """

    def __init__(
        self,
        message: Message,
        answer: Callable[[Message], T | Wait | None],
        *,
        tries: int = TRIES,
        every_s: float = ANSWER_S,
    ) -> None:
        self.answer: T | None = None
        self.over = False
        self.due_s = -inf
        self.number = message.command if message.get_type() == "COMMAND_LONG" else 0
        self.on_over: Callable[[], None] = lambda: None
        self._message, self._answer = message, answer
        self._left, self._every_s = tries, every_s
        self._sent = 0

    def due(self, now_s: float) -> Message | None:
        """The message, if it is to be sent now; gives it up after the last time."""
        if self.over or now_s < self.due_s:
            return None
        if not self._left:
            self.end()
            return None
        message = self._message
        if self.number:
            message = copy(message)  # the one before may wait to be packed
            message.confirmation = self._sent
        self._left, self._sent, self.due_s = self._left - 1, self._sent + 1, now_s + self._every_s
        return message

    def take(self, message: Message, now_s: float) -> None:
        """Take a message of the autopilot."""
        found = None if self.over or not self._sent else self._answer(message)
        if isinstance(found, Wait):
            self.due_s = now_s + found.seconds
            self._left = 0 if found.is_last else self._left
        elif found is not None:
            self.answer = found
            self.end()

    def end(self) -> None:
        """Send it no more, and wait for no answer."""
        self.over = True
        self.on_over()


@dataclass(frozen=True, slots=True)
class ParameterValue:
    """One parameter as a vehicle has it."""

    name: str
    value: float
    kind: int  # MAV_PARAM_TYPE

    @classmethod
    def of(cls, message: Message, *, bytewise: bool) -> ParameterValue:
        """What a PARAM_VALUE tells; `bytewise`: by PX4, which sends an integer's bytes as a float's."""
        layout = _WHOLE.get(message.param_type) if bytewise else None
        if layout is None:
            return cls(message.param_id, float(message.param_value), message.param_type)
        # From the packet itself: -1 would be a NaN, whose bytes may change when it is parsed as a float.
        packet = message.get_msgbuf()
        header = 10 if packet[0] == mavlink.PROTOCOL_MARKER_V2 else 6
        value = float(struct.unpack_from(layout, packet, header)[0])
        return cls(message.param_id, value, message.param_type)

    def on_wire(self, *, bytewise: bool) -> float:
        """The field of a PARAM_SET, as in `of`."""
        if self.kind == _FLOAT or not bytewise:
            return self.value
        layout = "<I" if self.kind == mavlink.MAV_PARAM_TYPE_UINT32 else "<i"
        as_float: float = struct.unpack("<f", struct.pack(layout, round(self.value)))[0]
        return as_float


class RateWatch:
    """Requests streams that come too slowly.

    Args:
        wanted_hz: that are requested, by message id.
        enough: share of that which needs no request.
        period_s: over which rates are measured.
        max_requests: times at which something was requested, after which nothing is.

    Attributes:
        left: of these.
        rates_hz: that were measured last, by message id.
    """

    def __init__(
        self,
        wanted_hz: Mapping[int, float],
        enough: float,
        period_s: float,
        now_s: float,
        max_requests: float = inf,
    ) -> None:
        self.left = max_requests
        self.rates_hz: dict[int, float] = {}
        self._wanted_hz, self._enough, self._period_s = wanted_hz, enough, period_s
        self._counts: Mapping[int, int] = {}
        self._since_s = now_s

    def requests(self, system_id: int, counts: Mapping[int, int], now_s: float) -> list[Message]:
        """The messages to send now, by the numbers of messages so far."""
        span_s = now_s - self._since_s
        if span_s < self._period_s:
            return []
        before = self._counts
        self.rates_hz = {
            each: (counts.get(each, 0) - before.get(each, 0)) / span_s for each in self._wanted_hz
        }
        self._counts, self._since_s = dict(counts), now_s
        slow = [
            request_rate(system_id, each, wanted_hz)
            for each, wanted_hz in self._wanted_hz.items()
            if self.rates_hz[each] < self._enough * wanted_hz
        ]
        if not slow or not self.left:
            return []
        self.left -= 1
        return slow


def pose_rates(
    wanted_hz: float, enough: float, period_s: float, now_s: float, max_requests: int
) -> RateWatch:
    """Of attitudes and positions; see `RateWatch`."""
    ids = (mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED)
    return RateWatch(dict.fromkeys(ids, wanted_hz), enough, period_s, now_s, max_requests)


class Session:
    """One vehicle and a client of it.

    Args:
        own_system_id: the client's, to which answers are sent; 0: answers to others count, too.
        system_id: the vehicle's; None: the first one that is heard.
        heartbeat: what is sent once a second.

    Attributes:
        system_id: None before it is heard.
        telemetry: what it reports.
        rates: streams that are requested when they come too slowly; None: none are.
    """

    def __init__(
        self,
        own_system_id: int = BROADCAST,
        system_id: int | None = None,
        *,
        heartbeat: Heartbeat = "none",
        telemetry: VehicleTelemetry | None = None,
    ) -> None:
        self.system_id = system_id
        self.telemetry = VehicleTelemetry() if telemetry is None else telemetry
        self.rates: RateWatch | None = None
        self._own_system_id = own_system_id
        self._heartbeat = heartbeat
        self._beat_due_s = -inf
        self._beat_type: int | None = None
        self._requests: list[Request[Any]] = []
        self._unsent: list[Message] = []

    @property
    def vehicle(self) -> int:
        """The system id of the vehicle, which was heard."""
        assert self.system_id is not None, "find the vehicle before sending requests to it"
        return self.system_id

    @property
    def is_ardupilot(self) -> bool:
        """Its autopilot is ArduPilot."""
        return bool(self.telemetry.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)

    @property
    def armed(self) -> bool:
        """Motors on, by the latest heartbeat."""
        return self.telemetry.armed

    @property
    def stream_counts(self) -> dict[int, int]:
        """Numbers of messages so far of the streams whose rates are watched: attitudes and positions."""
        ids = (mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED)
        return dict(zip(ids, (self.telemetry.attitudes, self.telemetry.positions), strict=True))

    def is_from_autopilot(self, message: Message) -> bool:
        """Whether a message is of the vehicle's autopilot; others' answer no request."""
        system_id, component_id = message.get_srcSystem(), message.get_srcComponent()
        return bool(system_id == self.system_id and component_id == AUTOPILOT_COMPONENT_ID)

    def take(self, message: Message, now_s: float) -> bool:
        """Take any message; whether it is the newest of its kind of telemetry, as `VehicleTelemetry.take`."""
        if self.system_id is None and is_vehicle(message):
            self.system_id = message.get_srcSystem()
        if not self.is_from_autopilot(message):
            return False
        for request in self._requests:
            request.take(message, now_s)
        self._requests = [each for each in self._requests if not each.over]
        return self.telemetry.take(message, now_s)

    def due(self, now_s: float) -> list[Message]:
        """What is to be sent now."""
        messages = [*self._heartbeats(now_s), *self._unsent]
        self._unsent = []
        commands: set[int] = set()
        for request in self._requests:
            # An acknowledgement names only the command's number, so those of one number wait for each other.
            if not request.number or request.number not in commands:
                commands.add(request.number)
                message = request.due(now_s)
                messages += [] if message is None else [message]
        self._requests = [each for each in self._requests if not each.over]
        if self.rates is not None and self.system_id is not None:
            messages += self.rates.requests(self.system_id, self.stream_counts, now_s)
        return messages

    def send(self, message: Message) -> None:
        """Let a message be among those that are due next."""
        self._unsent.append(message)

    def request(
        self,
        message: Message,
        answer: Callable[[Message], T | Wait | None],
        *,
        tries: int = TRIES,
        every_s: float = ANSWER_S,
    ) -> Request[T]:
        """Send a message until it is answered.

        Args:
            message: to send.
            answer: what a message of the vehicle's autopilot answers; None if it is another one.
            tries: how often it is sent.
            every_s: time between; after the last time the answer is awaited for so long.
        """
        request = Request(message, answer, tries=tries, every_s=every_s)
        self._requests.append(request)
        return request

    def command(
        self,
        number: int,
        *parameters: float,
        urgent: bool = False,
        tries: int = COMMAND_TRIES,
        every_s: float = ANSWER_S,
    ) -> Request[int]:
        """Send a MAV_CMD until it is acknowledged; the answer is a MAV_RESULT.

        Args:
            number: MAV_CMD.
            *parameters: the first ones of seven; the others are 0.
            urgent: a command of the same number that is not answered yet gets no answer.
            tries: how often it is sent.
            every_s: time between, and until it is given up.
        """
        for earlier in self._requests if urgent else ():
            if earlier.number == number:
                earlier.end()
        self._requests = [each for each in self._requests if not each.over]
        message = command_long(self.vehicle, number, *parameters)
        return self.request(message, partial(self._result_of, number), tries=tries, every_s=every_s)

    def message(self, message_id: int, tries: int = TRIES, every_s: float = ANSWER_S) -> Request[Message]:
        """Request a message once."""

        def answer(message: Message) -> Message | None:
            return message if message.get_msgId() == message_id else None

        return self.request(request_message(self.vehicle, message_id), answer, tries=tries, every_s=every_s)

    def parameter(self, name: str) -> Request[ParameterValue]:
        """Read a parameter."""
        return self.request(request_parameter(self.vehicle, name), partial(self._value_of, name))

    def set_parameter(self, parameter: ParameterValue) -> Request[ParameterValue]:
        """Set a parameter; the answer is what the vehicle has then."""
        name, kind = parameter.name, parameter.kind
        value = parameter.on_wire(bytewise=not self.is_ardupilot)
        message = mavlink.MAVLink_param_set_message(
            self.vehicle, AUTOPILOT_COMPONENT_ID, name.encode(), value, kind
        )
        return self.request(message, partial(self._value_of, name))

    def _heartbeats(self, now_s: float) -> list[Message]:
        """The heartbeat that is due: once a second, and at once when the client becomes another kind."""
        if self._heartbeat == "none":
            return []
        is_station = (
            self._heartbeat == "ground station" and self.telemetry.autopilot is not None and not self.armed
        )
        heartbeat = ground_station_heartbeat() if is_station else companion_heartbeat()
        if now_s < self._beat_due_s and heartbeat.type == self._beat_type:
            return []
        self._beat_due_s, self._beat_type = now_s + HEARTBEAT_S, heartbeat.type
        return [heartbeat]

    def _result_of(self, number: int, message: Message) -> int | Wait | None:
        if message.get_type() != "COMMAND_ACK" or message.command != number:
            return None
        if self._own_system_id and message.target_system not in (BROADCAST, self._own_system_id):
            return None
        return Wait(PROGRESS_S) if message.result == mavlink.MAV_RESULT_IN_PROGRESS else int(message.result)

    def _value_of(self, name: str, message: Message) -> ParameterValue | None:
        if message.get_type() != "PARAM_VALUE" or message.param_id != name:
            return None
        return ParameterValue.of(message, bytewise=not self.is_ardupilot)
