"""The simulator as a program: it starts, serves, and ends with all its ports closed."""

import asyncio
import os
import signal
import sys
from contextlib import ExitStack

import aiohttp
import pytest

from framerunner.errors import SettingError, UserError
from framerunner.flying.judges import ask_referee
from framerunner.flying.simulator_process import GenuineAutopilot, SitlProcess
from sitl.ardupilot.json_interface import FIRST_PORT, PORTS_AN_INSTANCE
from tests.processes import bound, free_instance, is_running, ports_are_free, program
from tests.waiting import until
from vision.types import CameraError

STANDS_IN = """
import os, signal, sys

def interrupted(*_):
    print("interrupted", file=sys.stderr, flush=True)
    os._exit(130)

signal.signal(signal.SIGTERM, interrupted)
os.write(int(sys.argv[1]), b"up\\n")
sys.stdin.read()
"""


def stand_in():
    """A child that says that it is up, and ends as the simulator does; for what does not ask it for more."""
    made = SitlProcess("empty")
    number = made._arguments[made._arguments.index("--time-grants") + 1]
    made._arguments = [sys.executable, "-S", "-c", STANDS_IN, number]
    return made


def test_two_simulators_run_side_by_side_until_a_signal_ends_them_and_frees_their_ports(tmp_path):
    first = free_instance(2)
    with ExitStack() as stack:
        sims = {}
        for instance in (first, first + 1):  # both start at once
            folder = tmp_path / str(instance)
            folder.mkdir()
            ground = ("--ground-remote", f"127.0.0.1:{14550 + instance}")
            sims[instance] = stack.enter_context(program(folder, "sim", "--instance", str(instance), *ground))
        for sim in sims.values():
            sim.wait_for("Ctrl-C stops", 60.0)
        for instance in sims:
            with bound(14540 + instance) as app:
                app.settimeout(5.0)
                packet = app.recv(300)
            assert packet[0] == 0xFD
            assert packet[5] == instance + 1  # the system's id
        for (instance, sim), number in zip(sims.items(), (signal.SIGINT, signal.SIGTERM), strict=True):
            assert not ports_are_free(instance)
            assert sim.end(number) == 130
            assert sim.err.splitlines()[-1] == "interrupted"
            assert "Traceback" not in sim.err
            assert ports_are_free(instance)


async def answering(sitl):
    async with aiohttp.ClientSession() as session:
        return await ask_referee(sitl.api, session)


async def test_a_child_simulator_answers_until_its_standard_input_ends():
    instance, said = free_instance(), []
    async with SitlProcess("test-case-1", instance=instance) as sitl:
        sitl._on_line = said.append
        answer = await answering(sitl)
        assert answer.scenario == "test-case-1"
        assert answer.snapshot.motors_on is False
        assert str(14540 + instance) in sitl.drone_url
        process = sitl._process
        process.stdin.write(b"still here\n")
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(process.wait(), 0.5)
        process.stdin.close()
        assert await asyncio.wait_for(process.wait(), 10) == 0
    assert "Traceback" not in "".join(said)
    assert ports_are_free(instance)


async def test_a_child_simulator_has_ended_afterwards():
    async with stand_in() as sitl:
        pid = sitl._process.pid
        assert is_running(pid)
    assert not is_running(pid)


async def test_its_last_line_is_the_reason_when_it_cannot_start():
    with pytest.raises(SettingError, match=r"code 2: unknown scenario .no-such-place"):
        async with SitlProcess("no-such-place", instance=free_instance()):
            pytest.fail("it has not started")


@pytest.mark.parametrize("ended", [True, False])
async def test_an_error_that_follows_from_its_end_is_replaced_by_its_last_line(ended):
    reason = "the simulator ended with code 130: interrupted" if ended else "cannot connect"
    with pytest.raises(UserError, match=reason):  # noqa: PT012 - the error comes from leaving the block
        async with stand_in() as sitl:
            if ended:
                os.kill(sitl._process.pid, signal.SIGTERM)
                await sitl._process.wait()
            raise CameraError("cannot connect")


async def test_a_flight_whose_simulator_ends_ends_with_the_reason_and_its_result():
    async with stand_in() as sitl:

        async def fly():
            try:
                await asyncio.Event().wait()
            except asyncio.CancelledError:
                return sitl.clock.gone

        flight = asyncio.create_task(fly())
        os.kill(sitl._process.pid, signal.SIGKILL)
        assert await sitl.guard(flight) == "the simulator was ended by signal 9"


async def test_that_a_stranger_has_taken_the_place_of_ardupilot_is_heard(tmp_path):
    heard, instance = [], free_instance()
    program = tmp_path / "build" / "sitl" / "bin" / "arducopter"
    program.parent.mkdir(parents=True)
    port = FIRST_PORT + PORTS_AN_INSTANCE * instance
    program.write_text(
        f"#!{sys.executable}\n"
        "import socket, struct, time\n"
        "frame = struct.pack('<HHI16H', 18458, 400, 1, *[1000] * 16)\n"
        "both = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]\n"
        "while True:\n"
        f"    for each in both: each.sendto(frame, ('127.0.0.1', {port}))\n"
        "    time.sleep(0.1)\n"
    )
    program.chmod(0o755)
    options = {"autopilot": GenuineAutopilot("ardupilot", tmp_path), "storage": tmp_path / "files"}
    async with SitlProcess("empty", 1.0, instance, **options, on_warning=heard.append):
        await until(lambda: heard)
    assert len(heard) == 1
    assert f"sends to UDP {port} is ignored: ArduPilot at 127.0.0.1:" in heard[0]


async def asks_it_once_more():
    try:
        await asyncio.sleep(30)
    finally:
        await asyncio.sleep(30)


@pytest.mark.parametrize("work", [lambda: asyncio.sleep(30), asks_it_once_more])
async def test_its_end_cancels_the_work_that_it_guards(work, monkeypatch):
    monkeypatch.setattr("framerunner.child_process._GRACE_S", 0.1)
    async with stand_in() as sitl:
        work = asyncio.create_task(work())
        os.kill(sitl._process.pid, signal.SIGKILL)
        with pytest.raises(SettingError, match="was ended by signal 9"):
            await asyncio.wait_for(sitl.guard(work), 20.0)
        assert work.cancelled()


async def test_the_result_of_work_that_was_cancelled_is_returned():
    async def flight():
        try:
            await asyncio.sleep(30)
        except asyncio.CancelledError:
            asyncio.current_task().uncancel()
            await asyncio.sleep(0.1)
            return "aborted"

    async def guarded():
        outcome = await sitl.guard(asyncio.create_task(flight()))
        await asyncio.sleep(0)  # what comes after it is not cancelled
        return outcome

    async with stand_in() as sitl:
        task = asyncio.create_task(guarded())
        await asyncio.sleep(0.1)
        task.cancel()
        assert await task == "aborted"


async def test_work_that_is_cancelled_stays_cancelled():
    async with stand_in() as sitl:
        work = asyncio.create_task(asyncio.sleep(30))
        task = asyncio.create_task(sitl.guard(work))
        await asyncio.sleep(0.1)
        task.cancel()
        with pytest.raises(asyncio.CancelledError):
            await task
        assert work.cancelled()
