"""The simulator as a child process."""

from __future__ import annotations

import asyncio
import socket
from typing import Self

from framerunner.child_process import ChildProcess
from framerunner.simulator_clock import SimulatorClock
from sitl.server_settings import VIDEO_PORT


class SitlProcess(ChildProcess):
    """`framerunner sim` as a child process.

    Args:
        scenario: name or file.
        speed: simulated seconds a second.
        instance: shifts its ports.
        links: more links, as `--link` takes them.

    Attributes:
        clock: its time, which waits for this program once asked to.
        system_id: MAVLink id of its drone.
        drone_url: where its MAVLink arrives.
        video_url: of its camera.
        referee_url: of its referee.
    """

    def __init__(
        self, scenario: str, speed: float = 1.0, instance: int = 0, links: tuple[str, ...] = ()
    ) -> None:
        here, there = socket.socketpair()
        arguments = [
            *("sim", "--lifeline", "--scenario", scenario),
            *("--speed", f"{speed:g}", "--instance", str(instance), "--video-rtp", "off"),
            *("--time-grants", str(there.fileno())),
            *(word for link in links for word in ("--link", link)),
        ]
        super().__init__("the simulator", arguments, handed=there)
        port = VIDEO_PORT + instance
        self.clock = SimulatorClock(here)
        self.system_id = instance + 1
        self.drone_url = f"udpin://127.0.0.1:{14540 + instance}"
        self.video_url = f"http://127.0.0.1:{port}/video"
        self.referee_url = f"http://127.0.0.1:{port}/referee.json"

    async def __aenter__(self) -> Self:
        """Start it, and wait until it says that all its ports are open.

        Raises:
            SettingError: it cannot start; its own words are the reason.
        """
        await super().__aenter__()
        try:
            await self.guard(asyncio.create_task(self.clock.up()))
        except BaseException:
            await self.__aexit__()
            raise
        return self

    async def __aexit__(self, *_: object) -> None:
        """Stop it."""
        self.clock.close()
        await super().__aexit__()
