"""All drones received on one link, as the pages need them; belongs to the asyncio loop."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from typing import Any, TypeVar

from framerunner.monitor.link_thread import LinkThread
from framerunner.monitor.ports import Equipment
from framerunner.monitor.vehicle.camera import host_of
from framerunner.monitor.vehicle.commands import OWN_SYSTEM, Answer, Sticks
from framerunner.monitor.vehicle.tries import TryEvent
from framerunner.monitor.vehicle.vehicle import MonitoredVehicle, VehicleCallbacks
from framerunner.wire.dialect import Message, ground_station_heartbeat, is_vehicle
from scenarios.models import Scenario

_TICK_S = 0.1
_HEARTBEAT_S = 1.0
_MAX_DRONES = 16
_FORGOTTEN_S = 600.0  # of silence, after which another drone may replace it
_MAX_TEXTS = 30
_MAX_FAULTS_LOGGED = 10

JsonMessage = dict[str, Any]
T = TypeVar("T")
_log = logging.getLogger(__name__)


class MonitoredFleet:
    """State of the drones on one link, and their commands; belongs to the loop on which `run` runs.

    Args:
        equipment: the link and what else the monitor was given.

    Attributes:
        faults: messages whose handling failed; the log has the reasons.
    """

    def __init__(self, equipment: Equipment) -> None:
        self._equipment = equipment
        self._vehicles: dict[int, MonitoredVehicle] = {}
        self._watchers: dict[object, Callable[[JsonMessage], None]] = {}
        self._try_watchers: list[Callable[[TryEvent], None]] = []
        self._texts: deque[JsonMessage] = deque(maxlen=_MAX_TEXTS)
        self._given_world = self._world = _world_of(equipment.scenario)
        self._said_full = False
        self._link = LinkThread(equipment.open_link, self._take, partial(self.notice, None))
        self.faults = 0

    async def run(self) -> None:
        """Receive until cancelled; a link that fails is opened again."""
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._link.run())
                tasks.create_task(self._tick_forever())
        finally:
            for vehicle in self._vehicles.values():
                vehicle.close()

    def welcome(self) -> list[JsonMessage]:
        """What a new watcher is sent first: world, chart, transitions, history, texts, status."""
        missions = [message for each in self._vehicles.values() for message in each.standing_messages()]
        problem = self._link.problem
        notices = [_notice(None, "error", f"{problem}; trying again")] if problem else []
        return [self._world, *missions, *self._texts, *notices, self.status_message()]

    def pose_message(self) -> JsonMessage:
        """The message of kind "pose", as of now."""
        now_s = asyncio.get_running_loop().time()
        poses = [vehicle.pose(now_s) for vehicle in self._vehicles.values()]
        return {"kind": "pose", "drones": [pose for pose in poses if pose is not None]}

    def status_message(self) -> JsonMessage:
        """The message of kind "status", as of now."""
        now_s = asyncio.get_running_loop().time()
        return {"kind": "status", "drones": [vehicle.status(now_s) for vehicle in self._vehicles.values()]}

    def subscribe(self, receive: Callable[[JsonMessage], None]) -> Callable[[], None]:
        """Receive all messages except pose and status: `receive` is called on the loop and must not block.

        Returns:
            Ends the subscription.
        """
        key = object()
        self._watchers[key] = receive
        return lambda: self._watchers.pop(key, None) and None

    def on_try(self, receive: Callable[[TryEvent], None]) -> None:
        """Receive all events of tries; `receive` is called on the loop and must not block."""
        self._try_watchers.append(receive)

    def drone_ids(self) -> list[int]:
        """System ids of the drones received so far."""
        return sorted(self._vehicles)

    def video_url(self, drone_id: int) -> str | None:
        """Where a drone's MJPEG is; None without one that may be requested."""
        vehicle = self._vehicles.get(drone_id)
        return vehicle.camera.url if vehicle is not None else None

    async def do(self, drone_id: int, what: str) -> Answer:
        """Carry out one of `vehicle.commands.ORDERS`, such as "land", and check that telemetry shows it."""
        vehicle = self._vehicles.get(drone_id)
        if vehicle is None:
            return Answer(False, f"no drone {drone_id} is heard")
        return await vehicle.do(what)

    def sticks(self, drone_id: int, sticks: Sticks | None) -> None:
        """Send a drone MANUAL_CONTROL at 25 Hz with these sticks; None stops it."""
        vehicle = self._vehicles.get(drone_id)
        if vehicle is not None:
            vehicle.sticks.set(sticks)

    def set_pilot(self, drone_id: int, name: str) -> None:
        """Set the name of the person who has a drone's sticks, for the status; "" for nobody."""
        vehicle = self._vehicles.get(drone_id)
        if vehicle is not None:
            vehicle.pilot = name

    def notice(self, drone_id: int | None, level: str, text: str) -> None:
        """Send all watchers one line about a drone or, if None, about no single one.

        Levels are "info", "warning" and "error".
        """
        self._publish(_notice(drone_id, level, text))

    def _take(self, messages: Sequence[Message], host: str = "") -> None:
        """Take messages that were received from a host; never raises."""
        now_s = asyncio.get_running_loop().time()
        for message in messages:
            try:
                system = message.get_srcSystem()
                vehicle = self._vehicles.get(system)
                if vehicle is None:
                    if system in (0, OWN_SYSTEM) or not is_vehicle(message) or not self._has_room(now_s):
                        continue
                    vehicle = self._add(system, now_s)
                vehicle.take(message, now_s, host)
            except Exception:  # no message may end the monitor
                self._log_fault(f"{message.get_type()} could not be taken")

    def _log_fault(self, what: str) -> None:
        self.faults += 1
        if self.faults <= _MAX_FAULTS_LOGGED:
            _log.exception("%s", what)

    def _has_room(self, now_s: float) -> bool:
        """Whether another drone can be added; removes one that has been silent for long."""
        if len(self._vehicles) < _MAX_DRONES:
            return True
        silent_id, silent = max(self._vehicles.items(), key=lambda item: item[1].link.age_s(now_s))
        if silent.link.age_s(now_s) > _FORGOTTEN_S:
            self._vehicles.pop(silent_id).close()
            return True
        if not self._said_full:
            self._said_full = True
            self.notice(None, "warning", f"more than {_MAX_DRONES} drones; the others are not shown")
        return False

    def _add(self, system: int, now_s: float) -> MonitoredVehicle:
        def publish_try(event: TryEvent) -> None:
            self._call_all(self._try_watchers, event, f"a try that {event.kind}")

        notice = partial(self.notice, system)
        callbacks = VehicleCallbacks(self._link.send, self._publish, notice, publish_try)
        vehicle = MonitoredVehicle(system, self._equipment, callbacks, now_s, host_of(self._link.url))
        self._vehicles[system] = vehicle
        self._vehicles = dict(sorted(self._vehicles.items()))
        self.notice(system, "info", f"drone {system} is heard")
        return vehicle

    def _publish(self, message: JsonMessage) -> None:
        if message["kind"] == "text":
            self._texts.append(message)
        self._call_all(list(self._watchers.values()), message, message["kind"])

    def _call_all(self, watchers: Iterable[Callable[[T], None]], message: T, what: str) -> None:
        for receive in watchers:
            try:
                receive(message)
            except Exception:  # the other watchers still get it
                self._log_fault(f"a watcher failed on {what}")

    async def _tick_forever(self) -> None:
        """Send heartbeats, update the vehicles, and send the world when it changes."""
        loop = asyncio.get_running_loop()
        sent_s = -_HEARTBEAT_S
        while True:
            now_s = loop.time()
            if now_s - sent_s >= _HEARTBEAT_S:
                sent_s = now_s
                self._link.send(ground_station_heartbeat())
            for vehicle in list(self._vehicles.values()):
                try:
                    vehicle.tick(now_s)
                except Exception:  # the other vehicles are still updated
                    self._log_fault(f"the update of drone {vehicle.id} failed")
            worlds = (vehicle.world() for vehicle in self._vehicles.values())
            world = next((each for each in worlds if each is not None), self._given_world)
            if world != self._world:
                self._world = world
                self._publish(world)
            await asyncio.sleep(_TICK_S)


def _world_of(scenario: Scenario | None) -> JsonMessage:
    """The message "world" of the given scenario while no drone has one of its own."""
    shown = None if scenario is None else scenario.model_dump(mode="json")
    return {"kind": "world", "scenario": shown, "lift_m": 0.0, "source": "telemetry"}


def _notice(drone_id: int | None, level: str, text: str) -> JsonMessage:
    return {"kind": "notice", "id": drone_id, "level": level, "text": text}
