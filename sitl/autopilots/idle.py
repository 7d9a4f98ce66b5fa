"""Whether another process of this machine has finished its work and waits. Linux only.

A simulator that sends the next sensors only then gets the same from an autopilot of many threads each time:
none of them sees a later time than the one that it was woken at.
"""

from __future__ import annotations

import sys
import time
from contextlib import suppress
from pathlib import Path

_EQUAL_READS = 3  # of the processor time of all threads, some microseconds apart
_PAUSE_S = 0.00005
_BOOT_PAUSE_S = 0.001
_WAITING = frozenset("SZXIt")  # states of threads that wait, or have ended; T is not one: it may go on


class IdleCheck:
    """Waits until a process is idle.

    Args:
        process_id: of a child, or of another process of this user.
        root: where processes are shown; another one is for tests.
    """

    def __init__(self, process_id: int, root: Path = Path("/proc")) -> None:
        self._process_id, self._root = process_id, root
        self._clock = (~process_id << 3) | 2  # clock_getcpuclockid(3) of Linux
        self._starting = sys.platform == "linux"
        self._usable = sys.platform == "linux"

    @property
    def starting(self) -> bool:
        """Its start-up script, a child of it, had not ended when `wait_started` looked last."""
        return self._starting

    def wait(self, limit_s: float) -> bool:
        """Wait until none of its threads has run for some microseconds; False if that takes longer.

        On a machine whose processors are all busy a thread that waits for one counts as idle.
        """
        if not self._usable:
            return False
        try:
            return self._wait(time.monotonic() + limit_s)
        except OSError:  # it has ended
            self._usable = False
            return False

    def _wait(self, end_s: float) -> bool:
        clock, read = self._clock, time.clock_gettime_ns
        used_ns, equal = read(clock), 1
        while equal < _EQUAL_READS:
            now_ns = read(clock)
            if now_ns == used_ns:
                equal += 1
                continue
            used_ns, equal = now_ns, 1
            if time.monotonic() > end_s:
                return False
            time.sleep(_PAUSE_S)
        return True

    def wait_started(self, limit_s: float) -> bool:
        """As `wait`, while it starts: all its threads and children must wait; False if that takes longer."""
        if not self._usable:
            return False
        end_s = time.monotonic() + limit_s
        idle = 0
        while idle < 2:
            waiting, children = self._look()
            self._starting = children > 0
            idle = idle + 1 if waiting else 0
            if time.monotonic() > end_s:
                return False
            time.sleep(_BOOT_PAUSE_S)
        return True

    def _look(self) -> tuple[bool, int]:
        """Whether all threads of the process and its descendants wait, and how many descendants there are."""
        processes = [self._process_id]
        for process in processes:  # grows
            for file in (self._root / str(process) / "task").glob("*/children"):
                with suppress(OSError):
                    processes += map(int, file.read_text().split())
        waiting = all(_state(file) in _WAITING for each in processes for file in self._threads(each))
        return waiting, len(processes) - 1

    def _threads(self, process: int) -> list[Path]:
        return list((self._root / str(process) / "task").glob("*/stat"))


def _state(file: Path) -> str:
    """The state in a thread's `stat`, after its name in parentheses; X if it has ended."""
    with suppress(OSError):
        return file.read_text().rpartition(")")[2].split()[0]
    return "X"
