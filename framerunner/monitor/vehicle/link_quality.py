"""How well a vehicle is received."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from framerunner.wire.framing import SequenceCounter

_SPAN_S = 10
_MAX_MISSING = 200  # a sequence number that is farther ahead belongs to a packet that was overtaken

STALE_S = 1.0
LOST_S = 3.0


@dataclass(slots=True)
class _Second:
    began_s: float
    heard: int = 0
    lost: int = 0


class LinkQuality:
    """Age, rate and losses of the autopilot's packets over the last ten seconds.

    Attributes:
        heard_s: when the last one was received, loop time.
    """

    def __init__(self, now_s: float) -> None:
        self.heard_s = now_s
        self._packets = SequenceCounter(_MAX_MISSING)
        self._seconds: deque[_Second] = deque([_Second(now_s)], maxlen=_SPAN_S)

    def count(self, sequence: int, now_s: float) -> None:
        """Count a packet with a sequence number of 0 to 255."""
        self.heard_s = now_s
        second = self._seconds[-1]
        if now_s - second.began_s >= 1.0:
            second = _Second(now_s)
            self._seconds.append(second)
        second.heard += 1
        second.lost += self._packets.take(sequence)  # -1: counted as missing before, and received now

    def forget_sequence(self) -> None:
        """Accept any next sequence number: the vehicle has restarted."""
        self._packets = SequenceCounter(_MAX_MISSING)

    def age_s(self, now_s: float) -> float:
        """Time since the last packet."""
        return max(0.0, now_s - self.heard_s)

    def state(self, now_s: float) -> str:
        """One of "live", "stale" and "lost"."""
        age_s = self.age_s(now_s)
        return "live" if age_s < STALE_S else "stale" if age_s < LOST_S else "lost"

    def as_dict(self, now_s: float) -> dict[str, object]:
        """The field `link` of the message "status"."""
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
