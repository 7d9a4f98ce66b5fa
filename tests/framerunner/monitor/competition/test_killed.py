"""A server that is killed loses no try that it showed as judged."""

import asyncio
import signal
import sys
from pathlib import Path

from framerunner.monitor.competition.database import Database
from framerunner.monitor.competition.store import Store

PROGRAM = """
import asyncio, sys
from framerunner.monitor.competition.service import CompetitionService
from tests.framerunner.monitor.competition.harness import EQUIPMENT, event

async def main():
    service = CompetitionService(sys.argv[1], EQUIPMENT)
    def hear(message):
        if message.kind == "changed" and any(each.state == "ended" for each in service._board.tries):
            sys.stdout.write("shown\\n")
            sys.stdout.flush()
            while True:  # killed here; nothing more is written
                pass
    work = asyncio.create_task(service.run())
    while service._board is None:
        await asyncio.sleep(0.01)
    service.subscribe(hear)
    service.on_try_event(event("began", "still flying", time_s=0.0))
    service.on_try_event(event("began", "flown", time_s=0.0))
    service.on_try_event(event("ended", "flown", time_s=33.25))
    await work

asyncio.run(main())
"""


async def test_no_judged_try_is_lost(database_url):
    server = await asyncio.create_subprocess_exec(
        sys.executable, "-c", PROGRAM, database_url,
        stdout=asyncio.subprocess.PIPE, cwd=Path(__file__).parents[4],
    )  # fmt: skip
    try:
        async with asyncio.timeout(60):
            assert await server.stdout.readline() == b"shown\n"
    finally:
        server.send_signal(signal.SIGKILL)
        await server.wait()
    store = Store(Database(database_url))
    flown, flying = store.board().tries
    assert (flown.state, flown.result.try_time_s, flown.judged) == ("ended", 33.25, True)
    assert flying.state == "running"
    store.interrupt()
    assert store.board().tries[1].state == "interrupted" and not store.board().tries[1].judged
    store.close()
