"""One core, one thread, processor time: what makes costs comparable between programs and moments.

Only the standard library, as the peers' environment has nothing of this project.
"""

from __future__ import annotations

import os
import resource
import time
from dataclasses import dataclass, field

SINGLE_THREADS = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "NUMBA_NUM_THREADS": "1",
    "LP_NUM_THREADS": "0",  # llvmpipe, Mesa's OpenGL without a graphics card: draw in the calling thread
    "LIBGL_ALWAYS_SOFTWARE": "1",  # the processor draws: a card's work is in no processor time
}
"""Environment variables; libraries read them when they are loaded."""


def pin_to_one_core() -> None:
    """Keep this process on one core, where the system can do that."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})


def processor_time_s() -> float:
    """Processor time of this process, its threads and its ended children, seconds."""
    usages = (resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN))
    return sum(usage.ru_utime + usage.ru_stime for usage in usages)


@dataclass(slots=True)
class Stopwatch:
    """Processor and wall time since it was made, seconds."""

    _began_s: tuple[float, float] = field(default_factory=lambda: (processor_time_s(), time.perf_counter()))

    def read(self) -> tuple[float, float]:
        """Processor time and wall time so far, seconds."""
        processor_s, wall_s = self._began_s
        return processor_time_s() - processor_s, time.perf_counter() - wall_s
