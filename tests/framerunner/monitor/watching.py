"""A fleet that runs beside a test, and waiting for its state."""

from __future__ import annotations

import asyncio
from contextlib import asynccontextmanager

from framerunner.monitor.fleet import MonitoredFleet
from framerunner.monitor.vehicle.tries import TryEvent


class Watched:
    """A running fleet and its messages.

    Attributes:
        heard: messages to watchers, but for pose and status.
        tries: events of tries.
    """

    def __init__(self, fleet: MonitoredFleet) -> None:
        self.fleet = fleet
        self.heard: list[dict] = []
        self.tries: list[TryEvent] = []
        fleet.subscribe(self.heard.append)
        fleet.on_try(self.tries.append)

    def notices(self):
        return [message["text"] for message in self.heard if message["kind"] == "notice"]

    def of_kind(self, kind):
        return [message for message in self.heard if message["kind"] == kind]

    def status(self, drone_id=1):
        drones = self.fleet.status_message()["drones"]
        return next((each for each in drones if each["id"] == drone_id), None)

    def pose(self, drone_id=1):
        drones = self.fleet.pose_message()["drones"]
        return next((each for each in drones if each["id"] == drone_id), None)

    async def until(self, condition, limit_s=20.0):
        """Wait for a condition; returns its value."""
        loop = asyncio.get_running_loop()
        end_s = loop.time() + limit_s
        while not (found := condition()):
            assert loop.time() < end_s, f"did not come: {self.status()} {self.notices()} {self.tries[-2:]}"
            await asyncio.sleep(0.005)
        return found

    async def until_ready(self, link, drone_id=1):
        """Wait until a drone can be armed, and its pose and status are known."""
        return await self.until(
            lambda: (
                link.drones[drone_id - 1].simulation.autopilot.status.ready
                and self.pose(drone_id)
                and (now := self.status(drone_id))["mode"]
                and now["landed"] is not None
                and now["voltage_v"] is not None
            )
        )


@asynccontextmanager
async def watching(equipment):
    """Run a fleet; no message may have failed inside when it ends."""
    watched = Watched(MonitoredFleet(equipment))
    task = asyncio.create_task(watched.fleet.run())
    try:
        yield watched
        assert not task.done(), task.exception()
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
    assert watched.fleet.faults == 0
