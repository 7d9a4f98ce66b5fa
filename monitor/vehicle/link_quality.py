"""How well a vehicle is heard, and what it is asked to send: seldom, and never for less than it sends."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from wire.dialect import Message, mavlink, request_message, request_rate
from wire.framing import missing_before

_SPAN_S = 10
_MAX_MISSING = 200  # a sequence number that is farther ahead belongs to a packet that was overtaken

STALE_S = 1.0
LOST_S = 3.0
_BOOT_TIME_EVERY_S = 2.0
_MAX_REQUESTS = 5
_RATE_SPAN_S = 3.0  # over which rates are measured
_ENOUGH_HZ = 15.0
_WANTED_HZ = 25.0


@dataclass(slots=True)
class _Second:
    began_s: float
    heard: int = 0
    lost: int = 0


class LinkQuality:
    """Age, rate and losses of the autopilot's packets over the last ten seconds.

    Attributes:
        heard_s: when the last one came, loop time.
    """

    def __init__(self, now_s: float) -> None:
        self.heard_s = now_s
        self._sequence: int | None = None
        self._seconds: deque[_Second] = deque([_Second(now_s)], maxlen=_SPAN_S)

    def hear(self, sequence: int, now_s: float) -> None:
        """Count a packet.

        Args:
            sequence: of the packet, 0 to 255.
            now_s: loop time.
        """
        self.heard_s = now_s
        second = self._seconds[-1]
        if now_s - second.began_s >= 1.0:
            second = _Second(now_s)
            self._seconds.append(second)
        second.heard += 1
        if self._sequence is not None:
            missing = missing_before(sequence, self._sequence, _MAX_MISSING)
            second.lost += missing  # -1: counted as missing before, and received now
            if missing < 0:
                return
        self._sequence = sequence

    def forget_sequence(self) -> None:
        """The vehicle has restarted, and its numbers begin at zero again."""
        self._sequence = None

    def age_s(self, now_s: float) -> float:
        """Time since the last packet."""
        return max(0.0, now_s - self.heard_s)

    def state(self, now_s: float) -> str:
        """Whether it is "live", "stale" or "lost"."""
        age_s = self.age_s(now_s)
        return "live" if age_s < STALE_S else "stale" if age_s < LOST_S else "lost"

    def as_dict(self, now_s: float) -> dict[str, object]:
        """The link as the status tells it."""
        recent = [second for second in self._seconds if now_s - second.began_s < _SPAN_S]
        heard = sum(second.heard for second in recent)
        lost = max(0, sum(second.lost for second in recent))
        span_s = max(1.0, now_s - recent[0].began_s) if recent else 1.0
        return {
            "state": self.state(now_s),
            "age_s": round(self.age_s(now_s), 1),
            "loss_percent": round(100 * lost / (heard + lost), 1) if heard else 0.0,
            "rate_hz": round(heard / span_s, 1),
        }


class BootTimeRequest:
    """Asks when the vehicle was switched on, until it has told."""

    def __init__(self, system_id: int) -> None:
        self._id = system_id
        self._asked_s = -1e9
        self._requests = 0

    def request(self, boot_unix_us: int | None, now_s: float) -> Message | None:
        """What is to be asked now.

        Args:
            boot_unix_us: what is known; None: nothing.
            now_s: loop time.
        """
        if boot_unix_us is not None or self._requests >= _MAX_REQUESTS:
            return None
        if now_s - self._asked_s < _BOOT_TIME_EVERY_S:
            return None
        self._asked_s = now_s
        self._requests += 1
        return request_message(self._id, mavlink.MAVLINK_MSG_ID_SYSTEM_TIME)


class RateWatch:
    """Asks for more attitude and position where they come too slowly for a picture."""

    def __init__(self, system_id: int, now_s: float) -> None:
        self._id = system_id
        self._since_s = now_s
        self._counts = (0, 0)
        self._requests = 0

    def requests(self, counts: tuple[int, int], now_s: float) -> list[Message]:
        """What is to be asked now.

        Args:
            counts: attitudes and positions so far.
            now_s: loop time.
        """
        span_s = now_s - self._since_s
        if span_s < _RATE_SPAN_S:
            return []
        rates_hz = [(now - then) / span_s for now, then in zip(counts, self._counts, strict=True)]
        self._since_s, self._counts = now_s, counts
        if not any(counts) or min(rates_hz) >= _ENOUGH_HZ or self._requests >= _MAX_REQUESTS:
            return []
        self._requests += 1
        wanted = (mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED)
        return [
            request_rate(self._id, number, _WANTED_HZ)
            for number, rate_hz in zip(wanted, rates_hz, strict=True)
            if rate_hz < _ENOUGH_HZ
        ]
