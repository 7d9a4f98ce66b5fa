"""What comes in over a vehicle's links, read so that no flood of it delays the control loop.

Reading and acting on input may take a quarter of one processor core. What comes faster waits, up to 64 KiB a
link, and what finds no room there is dropped: a late command is worth less than a lost one. Links take turns,
so a flood on one delays the input of another by milliseconds.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable

from firmware_py.mavlink.node import MavlinkNode

_SHARE = 0.25  # of a core
_MOST_SAVED_S = 0.004  # processor time for input after a quiet while: one control period
_STEPS_A_TURN = 4  # at most some 0.4 ms
_NOTICE_PERIOD_S = 10.0


class LinkInput:
    """Input of all links of one vehicle.

    Args:
        node: reads it and acts on it.
        notice: called with lines for people, when input was dropped.
        clock: monotonic seconds.
        processor_clock: processor time of this thread in seconds.
    """

    def __init__(
        self,
        node: MavlinkNode,
        notice: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
        processor_clock: Callable[[], float] = time.thread_time,
    ) -> None:
        self._node = node
        self._notice = notice
        self._clock, self._processor_clock = clock, processor_clock
        self._waiting: deque[str] = deque()  # names of links, whose turn is next first
        self._filled_s = clock()
        self._saved_s = _MOST_SAVED_S
        self._dropped_bytes: dict[str, int] = {}
        self._noticed_s = -_NOTICE_PERIOD_S

    def take(self, link: str, data: bytes) -> None:
        """Take bytes that came in on a link, and act on them at once as far as there is time.

        Args:
            link: its name.
            data: any piece of the stream.
        """
        dropped_bytes = self._node.add_input(link, data)
        if dropped_bytes:
            self._dropped_bytes[link] = self._dropped_bytes.get(link, 0) + dropped_bytes
        if link not in self._waiting:
            self._waiting.append(link)
        self.work()

    def work(self) -> None:
        """Act on input that waits, as far as there is time; to be called at every control tick."""
        now_s = self._clock()
        self._saved_s = min(_MOST_SAVED_S, self._saved_s + _SHARE * (now_s - self._filled_s))
        self._filled_s = now_s
        waiting = self._waiting
        while waiting and self._saved_s > 0.0:
            link = waiting.popleft()
            began_s = self._processor_clock()
            if self._node.process_input(link, _STEPS_A_TURN):
                waiting.append(link)
            self._saved_s -= self._processor_clock() - began_s
        if self._dropped_bytes and now_s - self._noticed_s >= _NOTICE_PERIOD_S:
            self._tell(now_s)

    def _tell(self, now_s: float) -> None:
        """Say what was dropped since it was last said."""
        self._noticed_s = now_s
        for link, dropped_bytes in self._dropped_bytes.items():
            self._notice(f"too much input on link {link}: {dropped_bytes / 1000:.0f} kB dropped")
        self._dropped_bytes.clear()
