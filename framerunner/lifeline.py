"""A program that ends with whoever started it."""

from __future__ import annotations

import asyncio
import os
import sys
import threading
from collections.abc import Callable, Coroutine


async def until_standard_input_ends(work: Coroutine[object, object, None]) -> None:
    """Do some work until it is done or standard input ends: whoever started this is gone then.

    Args:
        work: is cancelled in the second case.
    """
    running = asyncio.create_task(work)
    watching = asyncio.create_task(_standard_input_ends())
    done, _ = await asyncio.wait({running, watching}, return_when=asyncio.FIRST_COMPLETED)
    for task in (running, watching):
        task.cancel()
    await asyncio.gather(running, watching, return_exceptions=True)
    if running in done:
        running.result()


async def _standard_input_ends() -> None:
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    while await reader.read(1024):
        pass


def end_with_standard_input(tidy: Callable[[], None]) -> None:
    """Have this process end at once when standard input ends, whatever it is doing; for one without a loop.

    Args:
        tidy: is called before.
    """

    def watch() -> None:
        while os.read(0, 1024):
            pass
        tidy()
        os._exit(1)

    threading.Thread(target=watch, name="lifeline", daemon=True).start()
