"""An app that hangs, in a process of its own, must not go on flying the vehicle."""

from __future__ import annotations

import asyncio
import ctypes
import signal
import subprocess
import sys
import time
from textwrap import dedent

import pytest

from offboard.link.process_guard import ProcessGuard
from offboard.link.watchdog import HangLimits, Watchdog

pytestmark = pytest.mark.realtime

APP = dedent("""\
    import asyncio, ctypes, sys, time
    from offboard.drone import DroneError, VelocityFluCommand
    from offboard.mavsdk_drone import MavsdkDrone

    async def main(port, hang):
        drone = MavsdkDrone(f"udpin://127.0.0.1:{port}")
        await drone.connect()
        await drone.ready()
        await drone.motors_on()
        drone.command(VelocityFluCommand(forward_m_s=0.5))
        ticks = drone.ticks()
        for _ in range(10):
            await anext(ticks)
        print("hanging", flush=True)
        if hang == "free":
            time.sleep(6)  # the event loop stands still, other threads run
        else:
            ctypes.PyDLL(None).sleep(20)  # keeps the interpreter's lock: no other thread of Python runs
        try:
            await anext(ticks)
        except DroneError as error:
            print(error, flush=True)
        await drone.close()

    asyncio.run(main(int(sys.argv[1]), sys.argv[2]))
    """)


def run_app(vehicle, hang):
    command = [sys.executable, "-c", APP, str(vehicle.port), hang]
    app = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert app.stdout is not None
    assert app.stdout.readline() == "hanging\n"
    hung_s = time.monotonic()
    assert vehicle.setpoints[-1][1] == 0.5
    return app, hung_s


def test_a_hung_loop_is_stopped_and_hold_is_asked_for(vehicle):
    app, hung_s = run_app(vehicle, "free")
    out, _ = app.communicate(timeout=15)
    assert app.returncode == 0
    assert "this app hung for more than 3." in out
    last_s = max(at for at, *_ in vehicle.setpoints)
    assert last_s - hung_s < 4.5  # three seconds, and time for a busy machine
    zero = [0.0, 0.0, 0.0, 0.0]
    flown = [index for index, (_, *velocity) in enumerate(vehicle.setpoints) if velocity != zero]
    assert flown[-1] < len(vehicle.setpoints) - 1  # the last that is flown is to stand still
    assert vehicle.setpoints[flown[-1]][0] - hung_s < 1.5  # half a second, and time for a busy machine
    assert (176, 1.0 + 128.0, 4.0) in vehicle.commands  # armed, AUTO (hold) ...
    assert vehicle.mode == (4, 3)


def test_a_hang_that_blocks_the_interpreter_ends_the_process(vehicle):
    app, hung_s = run_app(vehicle, "locked")
    _, report = app.communicate(timeout=15)
    assert app.returncode == -signal.SIGKILL
    assert "most recent call first" in report
    last_s = max(at for at, *_ in vehicle.setpoints)
    assert last_s - hung_s < 5.0
    deadline_s = time.monotonic() + 5
    while vehicle.mode != (4, 3) and time.monotonic() < deadline_s:
        time.sleep(0.05)
    assert vehicle.mode == (4, 3)  # its own offboard-loss failsafe
    assert (176, 1.0 + 128.0, 4.0) not in vehicle.commands


LIMITS = HangLimits(stand_s=0.3, hang_s=1.5, locked_s=10.0)


async def hang(seconds, sleep=time.sleep):
    """What a watchdog did while the event loop stood still, and the watchdog."""
    done = []
    stand, stop = (lambda: done.append("stand")), (lambda: done.append("stop"))
    with ProcessGuard() as guard:
        watchdog = Watchdog(stand, stop, guard, limits=LIMITS)
        watchdog.start()
        await asyncio.sleep(2 * LIMITS.stand_s)
        sleep(seconds)
        await asyncio.sleep(2 * LIMITS.stand_s)
        watchdog.stop()
    return done, watchdog


async def test_a_turning_loop_is_left_alone():
    done, watchdog = await hang(0.0)
    assert done == []
    assert watchdog.tripped_after_s == 0.0


async def test_a_short_hang_makes_the_vehicle_stand_and_nothing_more():
    done, watchdog = await hang(0.7)
    assert done == ["stand"]
    assert watchdog.tripped_after_s == 0.0


async def test_a_long_hang_ends_commanding_once():
    done, watchdog = await hang(3.0)
    assert done == ["stand", "stop"]
    assert watchdog.tripped_after_s == pytest.approx(LIMITS.hang_s, abs=0.5)
    assert not watchdog.stood_still


async def test_a_process_that_was_stopped_knows_it_and_ends_commanding_once():
    """No thread of Python runs meanwhile, as after SIGSTOP."""
    done, watchdog = await hang(2, ctypes.PyDLL(None).sleep)
    assert done.count("stop") == 1
    assert watchdog.tripped_after_s == pytest.approx(2.0, abs=0.5)
    assert watchdog.stood_still
