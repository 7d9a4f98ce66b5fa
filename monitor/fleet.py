"""All drones heard on one link, as the pages need them; lives on the asyncio loop."""

from __future__ import annotations

import asyncio
import logging
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from monitor.listener import Listener
from monitor.ports import Equipment, Message
from monitor.sticks import RATE_HZ, Sticks, manual_control
from monitor.tries import TryEvent
from monitor.vehicle.camera import host_of
from monitor.vehicle.orders import OWN_SYSTEM
from monitor.vehicle.vehicle import Vehicle, VehicleCallbacks
from wire.dialect import ground_station_heartbeat, is_vehicle

_TICK_S = 0.1
_BEAT_S = 1.0
_MAX_DRONES = 16
_FORGOTTEN_S = 600.0  # of silence, after which another drone may take its place
_TEXTS = 30
_MAX_FAULTS_TOLD = 10

JsonMessage = dict[str, Any]
_log = logging.getLogger(__name__)


class Fleet:
    """What is known of the drones on one link, and the way to command them.

    All methods belong to the loop on which `run` runs.

    Args:
        equipment: the link and what else the monitor was given.

    Attributes:
        faults: messages whose handling failed inside; it should stay 0, and the log says why not.
    """

    def __init__(self, equipment: Equipment) -> None:
        self._equipment = equipment
        self._vehicles: dict[int, Vehicle] = {}
        self._watchers: dict[object, Callable[[JsonMessage], None]] = {}
        self._try_watchers: list[Callable[[TryEvent], None]] = []
        self._texts: deque[JsonMessage] = deque(maxlen=_TEXTS)
        self._streams: dict[int, asyncio.Task[None]] = {}
        self._sticks: dict[int, Sticks] = {}
        self._world: JsonMessage = self._given_world()
        self._said_full = False
        self._listener = Listener(equipment.open_link, self._take, partial(self.notice, None))
        self.faults = 0

    async def run(self) -> None:
        """Listen until cancelled; a link that fails is opened again."""
        try:
            async with asyncio.TaskGroup() as tasks:
                tasks.create_task(self._listener.run())
                tasks.create_task(self._keep_house())
        finally:
            for drone_id in list(self._streams):
                self.sticks(drone_id, None)
            for vehicle in self._vehicles.values():
                vehicle.close()

    def welcome(self) -> list[JsonMessage]:
        """What a new watcher is sent first: world, chart, transitions, texts, status."""
        missions = [message for each in self._vehicles.values() for message in each.standing_messages()]
        problem = self._listener.problem
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

    def subscribe(self, hear: Callable[[JsonMessage], None]) -> Callable[[], None]:
        """Hear all messages but pose and status, as they come.

        Args:
            hear: called on the loop; must not block.

        Returns:
            Ends it.
        """
        key = object()
        self._watchers[key] = hear
        return lambda: self._watchers.pop(key, None) and None

    def on_try(self, hear: Callable[[TryEvent], None]) -> None:
        """Hear of tries, for as long as the fleet lives.

        Args:
            hear: called on the loop; must not block.
        """
        self._try_watchers.append(hear)

    def drone_ids(self) -> list[int]:
        """System ids of the drones heard so far."""
        return sorted(self._vehicles)

    def video_url(self, drone_id: int) -> str | None:
        """Where a drone's MJPEG is; None if it told none that may be asked for."""
        vehicle = self._vehicles.get(drone_id)
        return vehicle.video_url if vehicle is not None else None

    async def do(self, drone_id: int, what: str) -> tuple[bool, str]:
        """Command a drone, and see that it does so.

        Args:
            drone_id: which.
            what: arm, disarm, take_off, land, hold, stop_motors, position or offboard.

        Returns:
            Whether telemetry shows it, and one line for people.
        """
        vehicle = self._vehicles.get(drone_id)
        if vehicle is None:
            return False, f"no drone {drone_id} is heard"
        return await vehicle.do(what)

    def sticks(self, drone_id: int, sticks: Sticks | None) -> None:
        """Hold a drone's sticks: MANUAL_CONTROL at 25 Hz with the latest value.

        Args:
            drone_id: which.
            sticks: where they are; None lets go.
        """
        if sticks is not None:
            self._sticks[drone_id] = sticks
            stream = self._streams.get(drone_id)
            if stream is None or stream.done():  # one that failed is started again
                self._streams[drone_id] = asyncio.create_task(self._stream_sticks(drone_id))
            return
        self._sticks.pop(drone_id, None)
        stream = self._streams.pop(drone_id, None)
        if stream is not None:
            stream.cancel()

    def set_pilot(self, drone_id: int, name: str) -> None:
        """Say who has a drone's sticks, for the status; "" for nobody."""
        vehicle = self._vehicles.get(drone_id)
        if vehicle is not None:
            vehicle.pilot = name

    def notice(self, drone_id: int | None, level: str, text: str) -> None:
        """Tell all watchers something.

        Args:
            drone_id: which drone it is about; None: none.
            level: "info", "warning" or "error".
            text: one line.
        """
        self._tell(_notice(drone_id, level, text))

    def _take(self, messages: Sequence[Message], host: str = "") -> None:
        """Take what came over the link from a host; never raises, whatever it is."""
        now_s = asyncio.get_running_loop().time()
        for message in messages:
            try:
                system = message.get_srcSystem()
                vehicle = self._vehicles.get(system)
                if vehicle is None:
                    if system in (0, OWN_SYSTEM) or not is_vehicle(message) or not self._has_room(now_s):
                        continue
                    vehicle = self._meet(system, now_s)
                vehicle.take(message, now_s, host)
            except Exception:  # the last boundary: no message may end the watching
                self._note_fault(f"{message.get_type()} could not be taken")

    def _note_fault(self, what: str) -> None:
        self.faults += 1
        if self.faults <= _MAX_FAULTS_TOLD:
            _log.exception("%s", what)

    def _has_room(self, now_s: float) -> bool:
        if len(self._vehicles) < _MAX_DRONES:
            return True
        silent_id, silent = max(self._vehicles.items(), key=lambda item: item[1].age_s(now_s))
        if silent.age_s(now_s) > _FORGOTTEN_S:
            self.sticks(silent_id, None)
            self._vehicles.pop(silent_id).close()
            return True
        if not self._said_full:
            self._said_full = True
            self.notice(None, "warning", f"more than {_MAX_DRONES} drones; the others are not shown")
        return False

    def _meet(self, system: int, now_s: float) -> Vehicle:
        notice = partial(self.notice, system)
        callbacks = VehicleCallbacks(self._listener.send, self._tell, notice, self._tell_try)
        vehicle = Vehicle(system, self._equipment, callbacks, now_s, host_of(self._listener.url))
        self._vehicles[system] = vehicle
        self._vehicles = dict(sorted(self._vehicles.items()))
        self.notice(system, "info", f"drone {system} is heard")
        return vehicle

    def _tell(self, message: JsonMessage) -> None:
        if message["kind"] == "text":
            self._texts.append(message)
        for hear in list(self._watchers.values()):
            try:
                hear(message)
            except Exception:  # one watcher's fault is not the others'
                self._note_fault(f"a watcher failed on {message['kind']}")

    def _tell_try(self, event: TryEvent) -> None:
        for hear in self._try_watchers:
            try:
                hear(event)
            except Exception:
                self._note_fault(f"a watcher failed on a try that {event.kind}")

    async def _keep_house(self) -> None:
        """Heartbeat, clocks, and the world when it changes."""
        loop = asyncio.get_running_loop()
        beat_s = -_BEAT_S
        while True:
            now_s = loop.time()
            if now_s - beat_s >= _BEAT_S:
                beat_s = now_s
                self._listener.send(ground_station_heartbeat())
            for vehicle in list(self._vehicles.values()):
                try:
                    vehicle.tick(now_s)
                except Exception:  # the others go on
                    self._note_fault(f"looking after drone {vehicle.id} failed")
            self._watch_world()
            await asyncio.sleep(_TICK_S)

    def _watch_world(self) -> None:
        worlds = (vehicle.world() for vehicle in self._vehicles.values())
        world = next((told for told in worlds if told is not None), None) or self._given_world()
        if world != self._world:
            self._world = world
            self._tell(world)

    def _given_world(self) -> JsonMessage:
        scenario = self._equipment.scenario
        told = None if scenario is None else scenario.model_dump(mode="json")
        return {"kind": "world", "scenario": told, "lift_m": 0.0, "source": "telemetry"}

    async def _stream_sticks(self, drone_id: int) -> None:
        loop = asyncio.get_running_loop()
        due_s = loop.time()
        while True:
            self._listener.send(manual_control(drone_id, self._sticks[drone_id]))
            due_s = max(due_s + 1 / RATE_HZ, loop.time())  # what was missed is not made up for
            await asyncio.sleep(due_s - loop.time())


def _notice(drone_id: int | None, level: str, text: str) -> JsonMessage:
    return {"kind": "notice", "id": drone_id, "level": level, "text": text}
