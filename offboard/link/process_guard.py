"""A guard beside this process, which needs no interpreter of this one; see `guard_process`."""

from __future__ import annotations

import faulthandler
import json
import logging
import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import IO, Self

_PROGRAM = Path(__file__).with_name("guard_process.py")
_END_S = 2.0
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
            [sys.executable, "-I", "-S", str(_PROGRAM), str(os.getpid()), json.dumps(self._words)],
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
