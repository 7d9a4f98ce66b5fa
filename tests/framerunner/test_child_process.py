"""The monitor as a child process, with a program in its place that prints what the monitor prints."""

import asyncio
import sys

import pytest

from framerunner.child_process import MonitorProcess
from framerunner.errors import SettingError
from framerunner.monitor import FIRST_VIEWER
from scenarios.loader import load_scenario
from tests.waiting import until

SHOWN = "import sys, time; print('monitor: http://127.0.0.1:1/', file=sys.stderr, flush=True); "
WATCHED = f"time.sleep(0.2); print({FIRST_VIEWER!r}, file=sys.stderr, flush=True); sys.stdin.read()"
FAILED = "sys.exit('error: the port is taken')"


def monitor(after):
    made = MonitorProcess(load_scenario("empty"))
    made._arguments = [sys.executable, "-c", SHOWN + after]
    return made


async def test_a_flight_begins_with_the_first_viewer_and_the_monitor_stays_until_it_is_told_to_end(capsys):
    async with monitor(WATCHED) as opened:
        await opened.opened()
        assert FIRST_VIEWER not in capsys.readouterr().err
        await opened.viewed()
        assert FIRST_VIEWER in capsys.readouterr().err
        staying = asyncio.create_task(opened.stay())
        await until(lambda: "stays open" in capsys.readouterr().err)
        assert not staying.done()
        staying.cancel()
        await staying
    assert not staying.cancelled()


async def test_a_monitor_that_ends_is_not_waited_for():
    async with monitor(FAILED) as opened:
        with pytest.raises(SettingError, match="the port is taken"):
            await opened.viewed()
