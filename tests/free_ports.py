"""Ports for tests, below the range from which the system takes those of outgoing connections."""

from __future__ import annotations

import os
import socket
from itertools import cycle


def worker_number() -> int:
    """The number of this process among all workers; a second run of pytest at the same time counts on."""
    first = int(os.environ.get("FRAMERUNNER_TEST_FIRST_WORKER", "0"))
    return first + int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])


_SIZE = 500
_FIRST = 21000 + _SIZE * (worker_number() % 9)  # parallel workers have ranges of their own
_candidates = cycle(range(_FIRST, _FIRST + _SIZE))


def free_port(count: int = 1) -> int:
    """The first of `count` successive ports, even if there are several, that are free for UDP and TCP."""
    for _ in range(_SIZE):
        port = next(_candidates)
        if (count == 1 or port % 2 == 0) and all(_is_free(port + number) for number in range(count)):
            return port
    raise RuntimeError(f"no free port in {_FIRST}..{_FIRST + _SIZE - 1}")


def _is_free(port: int) -> bool:
    for kind in (socket.SOCK_DGRAM, socket.SOCK_STREAM):
        with socket.socket(socket.AF_INET, kind) as probe:
            try:
                probe.bind(("0.0.0.0", port))
            except OSError:
                return False
    return True
