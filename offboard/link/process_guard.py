"""A guard beside this process, which needs no interpreter of this one: this file, run as a program.

The guard's standard input has lines with the seconds within which the next one must come; 0: none is
expected; `end`: the process that started it ends in order.
"""

from __future__ import annotations

import faulthandler
import json
import logging
import os
import select
import signal
import subprocess
import sys
import termios
import time
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, Self

_END_S = 2.0
_LOOK_S = 0.1
_TRACE_S = 0.2  # for which the other process may write where it stands
logger = logging.getLogger(__name__)


class ProcessGuard:
    """Ends this process when its interpreter stands still, and tells when it ends otherwise than in order.

    A process that is stopped and continued (SIGSTOP, a machine that stands still) goes on. The guard is
    started when it is needed first.

    Args:
        hung: line to print when this process was ended because it stood still; empty: none.
        ended: line to print when it has ended otherwise, after the guard was needed.
        trace: file for where it stood still; None: standard error.
        unfinished: file with what was flown so far, which becomes `result` then; None: there is none.
        result: see `unfinished`.
    """

    def __init__(
        self,
        *,
        hung: str = "",
        ended: str = "",
        trace: Path | None = None,
        unfinished: Path | None = None,
        result: Path | None = None,
    ) -> None:
        paths = {"trace": trace, "unfinished": unfinished, "result": result}
        names = {name: None if path is None else str(path.absolute()) for name, path in paths.items()}
        self._words = {"hung": hung, "ended": ended, **names}
        self._trace_path = trace
        self._trace: IO[str] | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._has_failed = False
        self.is_used = False

    def __enter__(self) -> Self:
        """Nothing; see `expect`."""
        return self

    def __exit__(self, *_: object) -> None:
        """See `close`."""
        self.close()

    def expect(self, limit_s: float) -> None:
        """This process stands still if this is not called again within some seconds; 0: it need not be."""
        if self._has_failed or (self._process is None and not limit_s):
            return
        self.is_used = True
        line = b"%g\n" % limit_s
        for _ in range(2):  # a guard that somebody has ended is started again
            try:
                process = self._process = self._process or self._started()
            except OSError as error:
                self._has_failed = True
                logger.warning("the guard against a hung app cannot be started (%s)", error.strerror)
                return
            assert process.stdin is not None
            try:
                os.write(process.stdin.fileno(), line)
            except BlockingIOError:  # it is stopped, and has thousands of lines
                return
            except OSError:
                self._forget()
            else:
                return

    def close(self) -> None:
        """This process will end in order."""
        process = self._process
        if process is not None and process.stdin is not None:
            with suppress(OSError):
                os.write(process.stdin.fileno(), b"end\n")
            self._forget()
        if self._trace is not None:
            faulthandler.unregister(signal.SIGUSR1)
            self._trace.close()
            self._trace = None

    def _started(self) -> subprocess.Popen[bytes]:
        if self._trace_path is not None and self._trace is None:
            with suppress(OSError):
                self._trace = self._trace_path.open("w", encoding="utf-8")
        with suppress(OSError, ValueError, RuntimeError):  # standard error may be no file
            faulthandler.register(signal.SIGUSR1, self._trace or sys.stderr)
        process = subprocess.Popen(
            [sys.executable, "-I", "-S", __file__, str(os.getpid()), json.dumps(self._words)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C and a closed terminal are for this process
        )
        assert process.stdin is not None
        os.set_blocking(process.stdin.fileno(), False)
        return process

    def _forget(self) -> None:
        process, self._process = self._process, None
        if process is None or process.stdin is None:
            return
        with suppress(OSError):
            process.stdin.close()
        try:
            process.wait(_END_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _watch(other: int, words: dict[str, Any]) -> None:
    """Watch until the other process ends in order; otherwise do what is left to do.

    Args:
        other: its process id.
        words: see `ProcessGuard`.
    """
    limit_s = silent_s = 0.0
    is_used, rest = False, b""
    while True:
        is_there = os.getppid() == other  # before the look: what it sent last is read
        if not select.select([0], [], [], _LOOK_S)[0]:
            if not is_there:  # others may have its end of the pipe
                break
            # Looks are counted: while this machine stands still there are none. A process that is stopped
            # sends nothing to its vehicle, and may go on.
            silent_s = 0.0 if _is_stopped(other) else silent_s + _LOOK_S
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
    _watch(int(sys.argv[1]), json.loads(sys.argv[2]))
