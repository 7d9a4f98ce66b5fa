"""The vehicle that gets the poses: its clock, what it reports, and what is requested of it."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Mapping
from statistics import median
from types import MappingProxyType

from framerunner.mocap.dialects import PoseDialect, dialect_of
from framerunner.mocap.facts import RoomOrigin
from framerunner.wire.ardupilot_messages import add_ardupilot_messages
from framerunner.wire.dialect import (
    Message,
    degrees_e7,
    mavlink,
    message_name,
    millimetres,
    request_message,
    request_parameter,
)
from framerunner.wire.session.record import Record
from framerunner.wire.session.session import RateWatch

_REQUEST_S = 1.0
_PARAMETER_S = 0.05
_ORIGIN_S = 1.0
_TIMESYNC_S = 0.2
_CONVERGED = 500  # answers after which PX4 converts time stamps
_KEPT = 30  # round trips
_STATE_S = 5.0  # for which a state counts that is requested twice a second
_LOW = 0.6  # share of the wanted rate


class PoseVehicle(Record):
    """The session with the vehicle, and what it has sent.

    Times in seconds are those of this program's clock, whose zero is its start.

    Args:
        needs_truth_hz: a simulator's true pose is requested, so many a second; 0: it is not.
        origin: set while the vehicle is disarmed, if it has none; None: nothing is set.
        zero_s: reading of the clock of the time stamps at this program's time 0.
        streams_hz: rates of further messages, by their ids.

    Attributes:
        answers: to its TIMESYNC requests, sent.
        rates_rad_s: the latest body rates with vehicle time in microseconds: (time, forward, right, down).
        worst_ratio: the largest innovation ratio of position or height.
    """

    def __init__(
        self,
        needs_truth_hz: float = 0.0,
        origin: RoomOrigin | None = None,
        zero_s: float = 0.0,
        *,
        streams_hz: Mapping[int, float] = MappingProxyType({}),
    ) -> None:
        super().__init__(heartbeat="companion")
        self.answers = 0
        self.rates_rad_s: deque[tuple[int, float, float, float]] = deque(maxlen=2000)
        self.worst_ratio = 0.0
        self._truth_hz, self._origin, self._zero_s = needs_truth_hz, origin, zero_s
        self._more_hz = streams_hz
        self._restarts = 0
        self._asked_origin = False  # a second ago, without an answer
        self._offsets: deque[tuple[float, float]] = deque(maxlen=_KEPT)  # round trip, offset
        self._due_s = {"timesync": 0.0, "parameter": 0.0, "origin": 0.0}

    @property
    def dialect(self) -> PoseDialect:
        """How its autopilot gets poses, by its heartbeats."""
        return dialect_of(self)

    @property
    def offset_s(self) -> float | None:
        """Vehicle time less this program's; None: not known yet.

        The median of the quicker half: the very quickest answers are those of a simulator that is catching
        up, whose clock is late meanwhile.
        """
        return median(offset for _, offset in self._quicker_half()) if self._offsets else None

    @property
    def transit_s(self) -> float:
        """Half of a quick way there and back; 0: not known yet."""
        if not self._offsets:
            return 0.0
        return median(round_trip_s for round_trip_s, _ in self._quicker_half()) / 2.0

    def _quicker_half(self) -> list[tuple[float, float]]:
        return sorted(self._offsets)[: (len(self._offsets) + 1) // 2]

    def stamp_us(self, now_s: float) -> int:
        """A time of this program as time stamps and TIMESYNC carry it: above zero."""
        return max(1, round((now_s + self._zero_s) * 1e6))

    @property
    def converts_stamps(self) -> bool:
        """Whether PX4 has got enough answers to convert time stamps."""
        return self.answers >= _CONVERGED

    def take(self, message: Message, now_s: float) -> bool:
        """Take any message; see `Record.take`."""
        is_newest, kind = super().take(message, now_s), message.get_type()
        if not self.is_from_autopilot(message):
            return False
        self._follow_restarts()
        if kind == "TIMESYNC":
            self._synchronise(message, now_s)
        elif kind == "HEARTBEAT" and self.is_ardupilot:
            add_ardupilot_messages()
        elif kind == "ATTITUDE":
            rates = (message.rollspeed, message.pitchspeed, message.yawspeed)
            self.rates_rad_s.append((message.time_boot_ms * 1000, *rates))
        elif kind == self.dialect.estimator and (status := self.estimator) is not None:
            self.worst_ratio = max(self.worst_ratio, status.ratios["position"], status.ratios["height"])
        return is_newest

    def listened(self, now_s: float) -> None:
        """All that has come by now was taken; a state of the estimator that is not renewed is forgotten."""
        self.listened_s = now_s
        for kind in (self.dialect.estimator, "SYS_STATUS"):
            if now_s - self.times_s.get(kind, (now_s, now_s))[1] > _STATE_S:
                self.latest.pop(kind, None)

    def _follow_restarts(self) -> None:
        """Forget what a vehicle loses when it is restarted."""
        restarts = self.telemetry.restarts
        if restarts != self._restarts:
            self._restarts = restarts
            for kind in ("GPS_GLOBAL_ORIGIN", self.dialect.estimator, "SYS_STATUS"):
                self.latest.pop(kind, None)
            self._asked_origin = False
            self._offsets.clear()

    def _synchronise(self, message: Message, now_s: float) -> None:
        if message.tc1 == 0:
            self.answers += 1
            self.send(mavlink.MAVLink_timesync_message(self.stamp_us(now_s) * 1000, message.ts1))
            return
        round_trip_s = now_s + self._zero_s - message.ts1 / 1e9
        if 0.0 <= round_trip_s < 1.0:
            self._offsets.append((round_trip_s, message.tc1 / 1e9 - (now_s - round_trip_s / 2.0)))

    def due(self, now_s: float) -> list[Message]:
        """What is to be sent, except poses. Only rates of this link and a missing origin are set."""
        return [*super().due(now_s), *self._regular(now_s)]

    def _regular(self, now_s: float) -> Iterator[Message]:
        system_id = self.system_id
        if system_id is None:
            return
        if self.rates is None:  # what is received less is requested; never less than the link has already
            self.rates = RateWatch(self._streams_hz, _LOW, _REQUEST_S, now_s)
        if self._is_due("timesync", now_s, _TIMESYNC_S):
            yield mavlink.MAVLink_timesync_message(0, self.stamp_us(now_s) * 1000)
        if self._is_due("parameter", now_s, _PARAMETER_S):
            yield from self._parameter_request(system_id, now_s)
        wants_origin = self.dialect.needs_origin or self._origin is not None
        if wants_origin and self._is_due("origin", now_s, _ORIGIN_S):
            yield from self._origin_requests(system_id)

    def _is_due(self, what: str, now_s: float, period_s: float) -> bool:
        if now_s < self._due_s[what]:
            return False
        self._due_s[what] = now_s + period_s
        return True

    def _parameter_request(self, system_id: int, now_s: float) -> Iterator[Message]:
        names = self.dialect.parameters
        missing = [name for name in names if name not in self.parameters]
        if not missing:
            self._due_s["parameter"] = now_s + 5.0  # they may be changed meanwhile
            missing = [*names]
        name = missing[int(now_s / _PARAMETER_S) % len(missing)]
        yield request_parameter(system_id, name)

    @property
    def _streams_hz(self) -> dict[int, float]:
        """Wanted rates, by message id."""
        truth = {self.dialect.truth: self._truth_hz} if self._truth_hz else {}
        return {**self.dialect.streams_hz, **truth, **self._more_hz}

    @property
    def stream_counts(self) -> dict[int, int]:
        """Numbers of these messages so far."""
        return {number: self.counts.get(message_name(number), 0) for number in self._streams_hz}

    def _origin_requests(self, system_id: int) -> Iterator[Message]:
        """Ask for the origin until it is known; set it if there is none and one was given."""
        if "GPS_GLOBAL_ORIGIN" in self.latest:
            self._asked_origin = False
            return
        if self._asked_origin and self._origin is not None and not self.armed:
            yield mavlink.MAVLink_set_gps_global_origin_message(
                system_id,
                degrees_e7(self._origin.latitude_deg),
                degrees_e7(self._origin.longitude_deg),
                millimetres(self._origin.altitude_m),
            )
        self._asked_origin = True
        yield request_message(system_id, mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN)
