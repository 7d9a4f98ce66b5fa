"""The vehicle that gets the poses: its clock, what it reports, and what is requested of it."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from framerunner.doctor.listen import Record
from wire.dialect import (
    AUTOPILOT_COMPONENT_ID,
    Message,
    companion_heartbeat,
    mavlink,
    request_rate,
)

PARAMETERS = (
    *("EKF2_EV_CTRL", "EKF2_EV_DELAY", "EKF2_EV_NOISE_MD", "EKF2_EVP_NOISE", "EKF2_EVA_NOISE"),
    *("EKF2_GPS_CTRL", "EKF2_HGT_REF", "EKF2_MAG_TYPE"),
)
_HEARTBEAT_S = 1.0
_REQUEST_S = 1.0
_PARAMETER_S = 0.05
_TIMESYNC_S = 0.2
_CONVERGED = 500  # answers after which PX4 converts time stamps
_KEPT = 30  # round trips
_WANTED_HZ = {
    "ATTITUDE": 50.0,
    "LOCAL_POSITION_NED": 30.0,
    "ESTIMATOR_STATUS": 2.0,
    "SYS_STATUS": 2.0,
    # PX4's filter estimates the drift per answer, so this rate must stay the same.
    "TIMESYNC": 20.0,
}
_LOW = 0.6  # share of the wanted rate


class Vehicle:
    """One vehicle on one link, seen by its messages.

    Times in seconds are those of this program's clock, whose zero is its start.

    Args:
        needs_truth_hz: HIL_STATE_QUATERNION is requested, so many a second; 0: it is not.

    Attributes:
        record: all that it has sent.
        answers: to its TIMESYNC requests, sent.
        rates_rad_s: the latest body rates with vehicle time in microseconds: (time, forward, right, down).
        worst_ratio: the largest innovation ratio of position or height.
    """

    def __init__(self, needs_truth_hz: float = 0.0) -> None:
        self.record = Record()
        self.answers = 0
        self.rates_rad_s: deque[tuple[int, float, float, float]] = deque(maxlen=2000)
        self.worst_ratio = 0.0
        self._wanted = dict(_WANTED_HZ)
        if needs_truth_hz:
            self._wanted["HIL_STATE_QUATERNION"] = needs_truth_hz
        self._offsets: deque[tuple[float, float]] = deque(maxlen=_KEPT)  # round trip, offset
        self._due_s = {"heartbeat": 0.0, "rates": 0.5, "timesync": 0.0, "parameter": 0.0}
        self._counted: dict[str, int] = {}
        self._counted_s = 0.0

    @property
    def found(self) -> bool:
        """Whether a vehicle has been heard."""
        return self.record.system_id is not None

    @property
    def offset_s(self) -> float | None:
        """Vehicle time less this program's; None: not known yet."""
        return min(self._offsets)[1] if self._offsets else None

    @property
    def converts_stamps(self) -> bool:
        """Whether PX4 has got enough answers to convert time stamps."""
        return self.answers >= _CONVERGED

    def take(self, message: Message, now_s: float) -> Message | None:
        """Take a message; the answer to send, if there is one."""
        self.record.take(message, now_s)
        if message.get_srcSystem() != self.record.system_id:
            return None
        if message.get_srcComponent() != AUTOPILOT_COMPONENT_ID:
            return None
        kind = message.get_type()
        if kind == "TIMESYNC":
            return self._synchronise(message, now_s)
        if kind == "ATTITUDE":
            rates = (message.rollspeed, message.pitchspeed, message.yawspeed)
            self.rates_rad_s.append((message.time_boot_ms * 1000, *rates))
        elif kind == "ESTIMATOR_STATUS":
            self.worst_ratio = max(self.worst_ratio, message.pos_horiz_ratio, message.pos_vert_ratio)
        return None

    def _synchronise(self, message: Message, now_s: float) -> Message | None:
        if message.tc1 == 0:
            self.answers += 1
            return mavlink.MAVLink_timesync_message(nanoseconds(now_s), message.ts1)
        round_trip_s = now_s - message.ts1 / 1e9
        if 0.0 <= round_trip_s < 1.0:
            self._offsets.append((round_trip_s, message.tc1 / 1e9 - (now_s - round_trip_s / 2.0)))
        return None

    def requests(self, now_s: float) -> Iterator[Message]:
        """What is due to be sent, except poses. Nothing in the vehicle is changed but rates of this link."""
        if self._is_due("heartbeat", now_s, _HEARTBEAT_S):
            yield companion_heartbeat()  # over udpout the vehicle cannot send before it has this address
        system_id = self.record.system_id
        if system_id is None:
            return
        if self._is_due("timesync", now_s, _TIMESYNC_S):
            yield mavlink.MAVLink_timesync_message(0, nanoseconds(now_s))
        if self._is_due("parameter", now_s, _PARAMETER_S):
            yield from self._parameter_request(system_id, now_s)
        if self._is_due("rates", now_s, _REQUEST_S):
            yield from self._rate_requests(system_id, now_s)

    def _is_due(self, what: str, now_s: float, period_s: float) -> bool:
        if now_s < self._due_s[what]:
            return False
        self._due_s[what] = now_s + period_s
        return True

    def _parameter_request(self, system_id: int, now_s: float) -> Iterator[Message]:
        missing = [name for name in PARAMETERS if name not in self.record.parameters]
        if not missing:
            self._due_s["parameter"] = now_s + 5.0  # they may be changed meanwhile
            missing = [*PARAMETERS]
        name = missing[int(now_s / _PARAMETER_S) % len(missing)]
        yield mavlink.MAVLink_param_request_read_message(system_id, AUTOPILOT_COMPONENT_ID, name.encode(), -1)

    def _rate_requests(self, system_id: int, now_s: float) -> Iterator[Message]:
        """Request what comes too slowly; never less than the link has already."""
        counts, span_s = self.record.counts, now_s - self._counted_s
        for name, wanted_hz in self._wanted.items():
            received_hz = (counts.get(name, 0) - self._counted.get(name, 0)) / span_s
            if received_hz < _LOW * wanted_hz:
                yield request_rate(system_id, getattr(mavlink, f"MAVLINK_MSG_ID_{name}"), wanted_hz)
        self._counted, self._counted_s = dict(counts), now_s


def nanoseconds(now_s: float) -> int:
    """This program's time as TIMESYNC carries it: above zero."""
    return max(1, round(now_s * 1e9))
