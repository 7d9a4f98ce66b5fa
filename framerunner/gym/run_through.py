"""Runs what is written for an event loop without one."""

from __future__ import annotations

from collections.abc import Coroutine


def run_through(coroutine: Coroutine[object, None, None]) -> None:
    """Run a coroutine of the lockstep drone, none of which ever waits.

    Args:
        coroutine: not yet begun.

    Raises:
        RuntimeError: it waits after all.
    """
    try:
        coroutine.send(None)
    except StopIteration:
        return
    coroutine.close()
    raise RuntimeError("a coroutine of the lockstep drone waits for something; nothing can come of it here")
