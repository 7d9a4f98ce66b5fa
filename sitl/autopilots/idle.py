"""Whether a child process has finished its work and waits. Linux only.

A simulator that sends the next sensors only then gets the same from an autopilot of many threads each time:
none of them sees a later time than the one that it was woken at.
"""

from __future__ import annotations

import asyncio
import os
import sys
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

_PAUSE_S = 0.00005
_ALONE_S = 0.002  # for which nothing else runs: most waits are shorter than a change to other tasks and back
_START_PAUSE_S = 0.001
_START_LOOKS = 3  # in a row
_WAITING = "SZXI"  # states of threads that wait or have ended; one that is stopped (T) may have work
_STAT_BYTES = 512


class IdleCheck:
    """Waits until a process is idle.

    Args:
        process_id: of the process, which leads a session of its own with its start-up script.
        names: of threads whose states are looked at; of the others only whether they use the processor.

    Attributes:
        starting: the start-up script had not ended when `wait_started` looked last.
    """

    def __init__(self, process_id: int, names: tuple[str, ...] = ()) -> None:
        self.starting = self._usable = sys.platform == "linux"
        self._process_id, self._names = process_id, names
        self._clock = _processor_clock(process_id)
        self._files: list[int] | None = None  # `stat` of the threads in `names`, open

    async def wait(self, limit_s: float) -> bool:
        """Wait until the process is idle; False if that takes longer, or it has ended.

        After two milliseconds other tasks run between two looks.
        """
        if not self._usable:
            return False
        try:
            files = self._opened() if self._files is None else self._files
            began_s = time.monotonic()
            while not self._is_idle(files):
                waited_s = time.monotonic() - began_s
                if waited_s > limit_s:
                    return False
                if waited_s < _ALONE_S:
                    time.sleep(_PAUSE_S)  # noqa: ASYNC251 - it is short
                else:
                    await asyncio.sleep(_PAUSE_S)
        except OSError:
            self.close()
            return False
        return True

    def wait_started(self, limit_s: float) -> bool:
        """Likewise, while it starts: nothing in its session, which has its start-up script, may have work."""
        if not self._usable:
            return False
        end_s, before, equal = time.monotonic() + limit_s, None, 0
        while equal < _START_LOOKS:
            used_ns = self._used_ns()
            equal = equal + 1 if used_ns == before and self._waits(used_ns) else 0
            before = used_ns
            if time.monotonic() > end_s:
                return False
            time.sleep(_START_PAUSE_S)
        self.starting = bool(before and len(before) > 1)
        return True

    def close(self) -> None:
        """Give up looking."""
        for file in self._files or ():
            os.close(file)
        self._files, self._usable, self.starting = None, False, False

    def _is_idle(self, files: list[int]) -> bool:
        read, clock = time.clock_gettime_ns, self._clock
        if read(clock) != read(clock):
            return False
        return all(_state(os.pread(file, _STAT_BYTES, 0)) in _WAITING for file in files)

    def _opened(self) -> list[int]:
        self._files = files = []  # so that `close` has those before a thread that has ended
        for thread in Path(f"/proc/{self._process_id}/task").iterdir():
            if (thread / "comm").read_bytes().decode().strip() in self._names:
                files.append(os.open(thread / "stat", os.O_RDONLY))
        return files

    def _used_ns(self) -> dict[int, int]:
        """Processor time that each process of the session has used."""
        used_ns = {}
        for folder in Path("/proc").glob("[0-9]*"):
            number = int(folder.name)
            with suppress(OSError):
                if os.getsid(number) == self._process_id:
                    used_ns[number] = time.clock_gettime_ns(_processor_clock(number))
        return used_ns

    def _waits(self, processes: Iterable[int]) -> bool:
        """Whether all threads of these processes wait."""
        for number in processes:
            for file in Path(f"/proc/{number}/task").glob("*/stat"):
                with suppress(OSError):
                    if _state(file.read_bytes()) not in _WAITING:
                        return False
        return True


def _processor_clock(process_id: int) -> int:
    """The clock of the processor time that all threads of a process use: clock_getcpuclockid(3) of Linux."""
    return (~process_id << 3) | 2


def _state(stat: bytes) -> str:
    """The state of a thread, which follows its name in parentheses."""
    return chr(stat[stat.rindex(b")") + 2])
