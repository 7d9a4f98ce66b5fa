"""Whether a child process waits."""

import asyncio
import os
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress

import pytest

from sitl.autopilots.idle import IdleCheck

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="IdleCheck is for Linux")


@contextmanager
def child(*command):
    with subprocess.Popen(command, start_new_session=True, stdout=subprocess.PIPE) as process:
        try:
            yield process
        finally:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)


def python(source):
    return (sys.executable, "-c", f"print(flush=True)\n{source}")


async def test_a_process_that_sleeps_is_idle_and_one_that_computes_is_not():
    with child(*python("import time; time.sleep(60)")) as process:
        process.stdout.readline()
        assert await IdleCheck(process.pid, ("python", "python3")).wait(2.0)
    with child(*python("while True: pass")) as process:
        process.stdout.readline()
        assert not await IdleCheck(process.pid, ("python", "python3")).wait(0.05)


async def test_a_named_thread_that_is_stopped_has_work():
    with child("sleep", "60") as process:
        await asyncio.sleep(0.1)
        check = IdleCheck(process.pid, ("sleep",))
        assert await check.wait(2.0)
        process.send_signal(signal.SIGSTOP)
        await asyncio.sleep(0.1)
        assert not await check.wait(0.05)


async def test_one_that_has_ended_is_not_waited_for():
    with child("true") as process:
        process.wait()
        check = IdleCheck(process.pid)
        began_s = time.monotonic()
        assert not await check.wait(5.0)
        assert time.monotonic() - began_s < 1.0


def test_a_process_starts_until_its_script_has_ended():
    with child("sh", "-c", "echo; sleep 60; true") as process:
        process.stdout.readline()
        check = IdleCheck(process.pid)
        assert check.wait_started(2.0)
        assert check.starting
    with child("sleep", "60") as process:
        time.sleep(0.1)
        check = IdleCheck(process.pid)
        assert check.wait_started(2.0)
        assert not check.starting


def test_a_script_that_computes_is_waited_for():
    with child("sh", "-c", "echo; while :; do :; done & sleep 60") as process:
        process.stdout.readline()
        check = IdleCheck(process.pid)
        assert not check.wait_started(0.3)
        assert check.starting


async def test_no_file_stays_open():
    before = len(os.listdir("/proc/self/fd"))
    with child("sleep", "60") as process:
        await asyncio.sleep(0.1)
        check = IdleCheck(process.pid, ("sleep",))
        assert await check.wait(2.0)
        check.close()
        assert not await check.wait(2.0)
    assert len(os.listdir("/proc/self/fd")) == before


async def test_other_tasks_run_while_a_process_that_computes_is_waited_for():
    turns = 0

    async def count():
        nonlocal turns
        while True:
            turns += 1
            await asyncio.sleep(0)

    with child(*python("while True: pass")) as process:
        process.stdout.readline()
        counting = asyncio.create_task(count())
        assert not await IdleCheck(process.pid, ("python", "python3")).wait(0.1)
        counting.cancel()
    assert turns > 10
