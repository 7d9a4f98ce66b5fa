"""What ArduPilot's JSON interface costs a step beside physics: `python -m benchmarks.ardupilot_bridge`.

Timed are the reading of ArduPilot's frames, the packing of the lines, and the whole step with physics and
sensors. `python -m benchmarks.ardupilot_bridge ARDUPILOT STEPS` steps with a genuine one instead, as fast as
both can, and counts frames that are missing or doubled.
"""

from __future__ import annotations

import asyncio
import sys
import time
from collections import Counter
from pathlib import Path

import sitl.ardupilot.simulation as simulated
from framerunner.vehicle.airframe import load_airframe
from scenarios.loader import load_scenario
from sitl.ardupilot.build import ArduPilotProcess, find_build
from sitl.ardupilot.json_interface import ServoFrame, decode_frame
from sitl.ardupilot.parameters import all_parameters
from sitl.ardupilot.server import ArduPilotServer, FrameExchange
from sitl.ardupilot.simulation import ArduPilotSimulation
from sitl.autopilots.process import AutopilotStart
from sitl.autopilots.sensors import with_estimable_sensors
from sitl.sensors.suite import load_suite
from sitl.server_settings import ServerSettings
from tests.sitl.ardupilot.fake_ardupilot import LAYOUTS

STEPS = 40_000
HOVER_US = 1510
SPEED, INSTANCE = 100.0, 7


def new_simulation() -> ArduPilotSimulation:
    """Test case 1, with motion capture."""
    return ArduPilotSimulation(with_estimable_sensors(load_scenario("test-case-1")))


def time_steps() -> None:
    """Print the mean times, microseconds a step."""
    exchange = FrameExchange(new_simulation())
    magic, layout = LAYOUTS[16]
    packets = [layout.pack(magic, 500, number, *(HOVER_US,) * 16) for number in range(STEPS)]
    packed_s = read_s = 0.0
    encode = simulated.encode_state

    def timed_encode(*arguments: object, **named: object) -> bytes:
        nonlocal packed_s
        began_s = time.thread_time()
        line = encode(*arguments, **named)  # type: ignore[arg-type]
        packed_s += time.thread_time() - began_s
        return line

    simulated.encode_state = timed_encode
    began_s = time.thread_time()
    for packet in packets:
        read_began_s = time.thread_time()
        frame = decode_frame(packet)
        read_s += time.thread_time() - read_began_s
        assert frame is not None
        exchange.answer(frame)
    all_s = time.thread_time() - began_s
    for name, seconds in (("packing", packed_s), ("reading", read_s), ("all of a step", all_s)):
        print(f"{name}: {1e6 * seconds / STEPS:.1f} us")


async def count_frames(folder: Path, steps: int) -> None:
    """Step with a genuine ArduPilot, and print how its frames were numbered."""
    settings = ServerSettings(instance=INSTANCE, speed=SPEED)
    simulation = new_simulation()
    values = all_parameters(load_airframe("abejorro"), load_suite("mocap"))
    process = ArduPilotProcess(
        find_build(folder), settings, simulation.place, values, None, takes_sensors=True
    )
    server = ArduPilotServer(new_simulation, settings, AutopilotStart(process, ""), print)
    increments: Counter[int] = Counter()
    last, answer = 0, server.exchange.answer

    def counted(frame: ServoFrame) -> bytes | None:
        nonlocal last
        increments[frame.number - last] += 1
        last = frame.number
        return answer(frame)

    server.exchange.answer = counted  # type: ignore[method-assign]
    task = asyncio.create_task(server.run())
    began_s = time.monotonic()
    while server.exchange.steps < steps and not task.done():  # noqa: ASYNC110 - it has no event
        await asyncio.sleep(1.0)
    simulated_s = server.exchange.steps * 0.002
    print(f"{server.exchange.steps} steps, {server.exchange.repeated} frames repeated after their answer")
    print(f"increments of the frame number: {dict(increments)}")
    print(f"{simulated_s / (time.monotonic() - began_s):.1f} times real time")
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        asyncio.run(count_frames(Path(sys.argv[1]), int(sys.argv[2])))
    else:
        time_steps()
