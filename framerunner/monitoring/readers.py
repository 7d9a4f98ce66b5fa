"""Runs the processes that read recorded flights, and ends them."""

from __future__ import annotations

import subprocess
import threading
from collections.abc import Sequence

_LONGEST_READ_S = 300.0
_MOST_SAID_BYTES = 100_000


class Readers:
    """The processes that are reading runs; may be used from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[bytes]] = set()
        self._closed = False

    def run(self, command: Sequence[str]) -> tuple[int, str]:
        """Run a process to its end.

        Its standard input is its lifeline: it ends when this process does, however that comes about.

        Returns:
            Its exit code and what it said on standard error.

        Raises:
            OSError: it cannot be started, or `close` was called.
        """
        with self._lock:
            if self._closed:
                raise OSError("closed")
            process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
            )
            self._running.add(process)
        assert process.stdin is not None
        assert process.stderr is not None
        deadline = threading.Timer(_LONGEST_READ_S, process.kill)
        deadline.start()
        try:
            said = process.stderr.read(_MOST_SAID_BYTES)
            code = process.wait()
        finally:
            deadline.cancel()
            with self._lock:
                self._running.discard(process)
            process.stdin.close()
            process.stderr.close()
        return code, said.decode(errors="replace")

    def close(self) -> None:
        """Kill what runs; nothing more is run."""
        with self._lock:
            self._closed = True
            for process in self._running:
                process.kill()
