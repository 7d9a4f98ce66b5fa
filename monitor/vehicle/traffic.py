"""How well a vehicle is heard: age, rate and losses over the last ten seconds."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

_SPAN_S = 10
_LATE = 200  # a sequence number that jumps farther belongs to a packet that was overtaken

STALE_S = 1.0
LOST_S = 3.0


@dataclass(slots=True)
class _Second:
    began_s: float
    heard: int = 0
    lost: int = 0


class Traffic:
    """Counts the packets of the autopilot.

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
            missing = (sequence - self._sequence - 1) & 0xFF
            if missing > _LATE:
                second.lost -= 1  # counted as missing before, and here it is
                return
            second.lost += missing
        self._sequence = sequence

    def forget_sequence(self) -> None:
        """The vehicle began anew, and so do its numbers."""
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
