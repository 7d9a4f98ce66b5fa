"""The program that `ProcessGuard` starts: it watches the process that started it, from outside.

Its standard input has lines with the seconds within which the next one must come; 0: none is expected; `end`:
the other process ends in order. Only parts of the standard library that load quickly are used here.
"""

from __future__ import annotations

import json
import os
import select
import signal
import sys
import termios
import time
from contextlib import suppress
from typing import Any

LOOK_S = 0.1
_TRACE_S = 0.2  # for which the other process may write where it stands


def main(other: int, words: dict[str, Any]) -> None:
    """Watch until the other process ends in order; otherwise do what is left to do.

    Args:
        other: its process id.
        words: see `ProcessGuard`.
    """
    limit_s = silent_s = 0.0
    is_used, rest = False, b""
    while True:
        is_there = os.getppid() == other  # before the look: what it sent last is read
        if not select.select([0], [], [], LOOK_S)[0]:
            if not is_there:  # others may have its end of the pipe
                break
            # Looks are counted: while this machine stands still there are none. A process that is stopped
            # sends nothing to its vehicle, and may go on.
            silent_s = 0.0 if _is_stopped(other) else silent_s + LOOK_S
            if 0.0 < limit_s < silent_s:
                _end(other)
                _tell(words["hung"], words)
                return
            continue
        data = os.read(0, 65536)
        if not data:
            break
        *lines, rest = (rest + data).split(b"\n")
        if b"end" in lines:
            return
        silent_s = 0.0
        for line in lines:
            limit_s = float(line)
            is_used = is_used or limit_s > 0.0
    if is_used:
        _tell(words["ended"], words)


def _is_stopped(process: int) -> bool:
    """Whether it is stopped (SIGSTOP) or held by a debugger; False where that cannot be seen."""
    with suppress(OSError, IndexError), open(f"/proc/{process}/stat", "rb") as file:
        return file.read().rpartition(b")")[2].split()[0] in b"Tt"
    return False


def _end(process: int) -> None:
    """End it, after it was asked for the stacks of its threads; its interpreter need not run for that."""
    with suppress(ProcessLookupError):
        os.kill(process, signal.SIGUSR1)
        time.sleep(_TRACE_S)
        os.kill(process, signal.SIGKILL)


def _tell(line: str, words: dict[str, Any]) -> None:
    """Keep what was flown as the result, and print a line in a terminal that is usable again.

    Who reads the operator's keys leaves a terminal without lines and echo; the live table hides its cursor.
    """
    with suppress(OSError):
        if words["trace"] and not os.path.getsize(words["trace"]):
            os.remove(words["trace"])
    with suppress(OSError):
        if words["unfinished"]:
            os.replace(words["unfinished"], words["result"])
    with suppress(OSError, termios.error):
        if os.isatty(2):
            modes = termios.tcgetattr(2)
            modes[3] |= termios.ICANON | termios.ECHO
            termios.tcsetattr(2, termios.TCSADRAIN, modes)
            os.write(2, b"\033[?25h\n")
        if line:
            os.write(2, f"{line}\n".encode())


if __name__ == "__main__":
    main(int(sys.argv[1]), json.loads(sys.argv[2]))
