"""`framerunner sim`: the simulated drone as a program."""

from __future__ import annotations

import asyncio
import sys
from typing import Annotated

from cyclopts import Parameter

from framerunner.commands.options import WholeNumber
from framerunner.errors import SettingError


def sim(
    *,
    scenario: Annotated[str, Parameter(help="name or file; without it an empty field with a base")] = "empty",
    speed: Annotated[float, Parameter(help="simulated seconds a second, 0.01 to 1000")] = 1.0,
    instance: Annotated[WholeNumber, Parameter(help="shifts all ports and the system id, 0 to 9")] = 0,
    bind: Annotated[str, Parameter(help="address to listen on")] = "127.0.0.1",
    onboard_remote: Annotated[
        str, Parameter(help="host that gets the onboard link, UDP 14540")
    ] = "127.0.0.1",
    ground_remote: Annotated[str, Parameter(help="host that gets the ground link, UDP 14550")] = "127.0.0.1",
    video_port: Annotated[
        WholeNumber | None, Parameter(help="TCP port of the video; 8080 + instance")
    ] = None,
    lifeline: Annotated[bool, Parameter(show=False, help="stop when standard input ends")] = False,
) -> int:
    """Start the simulated drone: MAVLink on UDP 14540 and 14550, video on http://127.0.0.1:8080/.

    Stop it with Ctrl-C.

    **Examples**

        framerunner sim

        framerunner sim --scenario test-case-1 --speed 2

        framerunner sim --ground-remote 192.168.1.20
    """
    if not 0.01 <= speed <= 1000:
        raise SettingError(f"--speed {speed:g}: must be from 0.01 to 1000")
    if not 0 <= instance <= 9:
        raise SettingError(f"--instance {instance}: must be from 0 to 9")
    if video_port is not None and not 1 <= video_port <= 65535:
        raise SettingError(f"--video-port {video_port}: must be from 1 to 65535")

    from scenarios.loader import load_scenario
    from sitl.server import ServerSettings, SimulatorServer
    from sitl.simulation import Simulation

    settings = ServerSettings(
        instance=instance,
        bind=bind,
        onboard_remote=onboard_remote,
        ground_remote=ground_remote,
        video_port=video_port,
        speed=speed,
    )
    loaded = load_scenario(scenario)
    server = SimulatorServer(Simulation(loaded), settings, notice=_say)
    asyncio.run(_run(server, lifeline=lifeline))
    return 0


async def _run(server: object, *, lifeline: bool) -> None:
    from sitl.server import SimulatorServer

    assert isinstance(server, SimulatorServer)
    if not lifeline:
        await server.run()
        return
    running = asyncio.create_task(server.run())
    watching = asyncio.create_task(_standard_input_ends())
    done, _ = await asyncio.wait({running, watching}, return_when=asyncio.FIRST_COMPLETED)
    for task in (running, watching):
        task.cancel()
    await asyncio.gather(running, watching, return_exceptions=True)
    if running in done:
        running.result()


async def _standard_input_ends() -> None:
    """Return when whoever started this process is gone, however it went."""
    loop = asyncio.get_running_loop()
    reader = asyncio.StreamReader()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    while await reader.read(1024):
        pass


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
