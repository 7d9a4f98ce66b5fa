"""A whole monitor on a port of its own, for the pilot's tests."""

import asyncio
from contextlib import asynccontextmanager, suppress

from framerunner.monitor.run import serve
from framerunner.monitor.settings import MonitorSettings


@asynccontextmanager
async def served(equipment, folder):
    """Serve a monitor; yields its URL."""
    started = asyncio.get_running_loop().create_future()

    def say(line):
        if line.startswith("monitor: ") and not started.done():
            started.set_result(line.removeprefix("monitor: "))

    settings = MonitorSettings(port=0, database=f"sqlite:///{folder / 'monitor.db'}")
    task = asyncio.create_task(serve(equipment, settings, say))
    try:
        await asyncio.wait({task, started}, return_when=asyncio.FIRST_COMPLETED, timeout=30.0)
        yield started.result() if started.done() else task.result()
        assert not task.done(), task.exception()
    finally:
        task.cancel()
        with suppress(asyncio.CancelledError):
            await task
