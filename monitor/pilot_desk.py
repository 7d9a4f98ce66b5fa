"""All seats: who sits where is told to every browser, and a watch looks after those who fell silent."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from typing import Any, Protocol

from monitor.pilot_messages import Order
from monitor.pilot_seat import Answer, Clock, DroneView, Person, PilotSeat
from monitor.sticks import Sticks

WATCH_PERIOD_S = 0.05
_NOBODY = ("", None, False)

JsonMessage = dict[str, Any]
logger = logging.getLogger(__name__)


class Vehicles(Protocol):
    """What the desk needs of `Fleet`."""

    def drone_ids(self) -> list[int]:
        """See `Fleet`."""
        ...

    def status_message(self) -> JsonMessage:
        """See `Fleet`."""
        ...

    async def do(self, drone_id: int, what: str) -> tuple[bool, str]:
        """See `Fleet`."""
        ...

    def sticks(self, drone_id: int, sticks: Sticks | None) -> None:
        """See `Fleet`."""

    def set_pilot(self, drone_id: int, name: str) -> None:
        """See `Fleet`."""

    def notice(self, drone_id: int | None, level: str, text: str) -> None:
        """See `Fleet`."""


class Browser(Person):
    """A person at a browser that can be told things.

    Args:
        name: for other people.
        may_judge: may take the sticks from anybody.
        tell: sends a message; must not block.
    """

    __slots__ = ("tell",)

    def __init__(self, name: str, may_judge: bool, tell: Callable[[JsonMessage], None]) -> None:
        super().__init__(name, may_judge)
        self.tell = tell


class PilotDesk:
    """The seats of all drones.

    Args:
        vehicles: the drones.
        clock: time; that of the machine by default.
    """

    def __init__(self, vehicles: Vehicles, clock: Clock | None = None) -> None:
        self._vehicles = vehicles
        self._clock = clock or Clock(time.monotonic)
        self._seats: dict[int, PilotSeat] = {}
        self._browsers: list[Browser] = []
        self._told: dict[int, tuple[str, Person | None, bool]] = {}
        self._watch: asyncio.Task[None] | None = None

    def come(self, browser: Browser) -> None:
        """A browser is there: tell it who sits where."""
        self._browsers.append(browser)
        for drone_id in self._seats:
            browser.tell(self._seat_message(drone_id, browser))
        if self._watch is None or self._watch.done():
            self._watch = asyncio.get_running_loop().create_task(self._keep_watch(), name="pilot's dead man")

    def go(self, browser: Browser) -> None:
        """A browser is gone; a drone that it flew holds."""
        self._browsers.remove(browser)
        for seat in self._seats.values():
            seat.leave(browser)

    def sticks(self, browser: Browser, sticks: Sticks) -> None:
        """Take a browser's sticks, for the drone whose seat it has."""
        for seat in self._seats.values():
            seat.sticks(browser, sticks)

    async def do(self, browser: Browser, order: Order) -> Answer:
        """Carry out an order, or say why not."""
        drone_id = order.drone_id
        if drone_id not in self._vehicles.drone_ids():
            return Answer(False, f"no drone {drone_id} is heard")
        for other_id, other in self._seats.items():
            if order.what == "take" and other_id != drone_id and other.person is browser:
                return Answer(False, f"you have the sticks of drone {other_id}; give them back first")
        seat = self._seats.get(drone_id)
        if seat is None:
            seat = PilotSeat(drone_id, _DeskDrone(drone_id, self._vehicles, self._announce), self._clock)
            self._seats[drone_id] = seat
        return await seat.do(browser, order)

    def tick(self) -> None:
        """Look after all seats once; a seat that fails does not keep the others from being looked at."""
        for drone_id, seat in self._seats.items():
            try:
                seat.tick()
            except Exception:
                logger.exception("drone %d: looking after its pilot failed", drone_id)

    async def _keep_watch(self) -> None:
        while self._browsers or not all(seat.idle for seat in self._seats.values()):
            self.tick()
            await asyncio.sleep(WATCH_PERIOD_S)

    def _announce(self, drone_id: int) -> None:
        seat = self._seats.get(drone_id)
        if seat is None:
            return
        name = "" if seat.person is None else seat.person.name
        now = (name, seat.person, seat.flying)
        if self._told.get(drone_id, _NOBODY) == now:
            return
        self._told[drone_id] = now
        self._vehicles.set_pilot(drone_id, name)
        for browser in self._browsers:
            browser.tell(self._seat_message(drone_id, browser))

    def _seat_message(self, drone_id: int, browser: Browser) -> JsonMessage:
        seat = self._seats[drone_id]
        return {
            "kind": "seat",
            "id": drone_id,
            "pilot": "" if seat.person is None else seat.person.name,
            "yours": seat.person is browser,
            "flying": seat.flying,
        }


class _DeskDrone:
    """One drone of the fleet, as its seat sees it."""

    def __init__(self, drone_id: int, vehicles: Vehicles, announce: Callable[[int], None]) -> None:
        self._id = drone_id
        self._vehicles = vehicles
        self._announce = announce

    def view(self) -> DroneView:
        for status in self._vehicles.status_message()["drones"]:
            if status["id"] == self._id:
                mission = status["mission"]
                waits = mission is not None and mission["alive"] and mission["paused"]
                return DroneView(
                    mode=str(status["mode"]).upper(),
                    armed=bool(status["armed"]),
                    alive=status["link"]["state"] == "live",
                    waiting_mission=(mission["name"] or "without a name") if waits else "",
                )
        return DroneView()

    async def do(self, what: str) -> tuple[bool, str]:
        return await self._vehicles.do(self._id, what)

    def sticks(self, sticks: Sticks | None) -> None:
        self._vehicles.sticks(self._id, sticks)

    def seat_changed(self) -> None:
        self._announce(self._id)

    def notice(self, level: str, text: str) -> None:
        self._vehicles.notice(self._id, level, text)
