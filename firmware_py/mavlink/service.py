"""The one shape of all MAVLink services, and the entries of their tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import isfinite, nan
from types import MappingProxyType
from typing import Any, TypeVar

from firmware_py.autopilot import Autopilot
from firmware_py.missions.flight import SevenParams
from firmware_py.status import CommandResult
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, BROADCAST, Message, device_heartbeat, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

_NOT_GIVEN = 0x7FFFFFFF  # of x and y in COMMAND_INT
_RELATIVE_FRAMES = (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)
_EMPTY: Mapping[int, Any] = MappingProxyType({})
_HEARTBEAT_US = 1_000_000
Entry = TypeVar("Entry")


@dataclass(frozen=True, slots=True)
class VehicleCommand:
    """A COMMAND_LONG or COMMAND_INT; NaN means "not given"."""

    link: Link  # on which it was received
    params: tuple[float, float, float, float]  # 1 to 4
    latitude_deg: float = nan  # param 5 or x
    longitude_deg: float = nan  # param 6 or y
    altitude_m: float = nan  # param 7 or z; above mean sea level or, with a relative frame, above home
    frame: int = mavlink.MAV_FRAME_GLOBAL
    params_567: tuple[float, float, float] = (nan, nan, nan)  # as received; not always a position
    sender: tuple[int, int] = (BROADCAST, BROADCAST)  # system and component id
    repeated: bool = False  # it was sent before, and no acknowledgement was received

    @classmethod
    def from_long(cls, link: Link, message: Message) -> VehicleCommand:
        """The command of a COMMAND_LONG."""
        p5, p6, p7 = message.param5, message.param6, message.param7
        params = (message.param1, message.param2, message.param3, message.param4)
        sender = (message.get_srcSystem(), message.get_srcComponent())
        repeated = message.confirmation > 0
        return cls(link, params, p5, p6, p7, params_567=(p5, p6, p7), sender=sender, repeated=repeated)

    @classmethod
    def from_int(cls, link: Link, message: Message) -> VehicleCommand:
        """The command of a COMMAND_INT."""
        return cls(
            link,
            (message.param1, message.param2, message.param3, message.param4),
            nan if message.x == _NOT_GIVEN else message.x / 1e7,
            nan if message.y == _NOT_GIVEN else message.y / 1e7,
            message.z,
            message.frame,
            (float(message.x), float(message.y), message.z),
            (message.get_srcSystem(), message.get_srcComponent()),
        )

    @property
    def all_params(self) -> SevenParams:
        """Params 1 to 7 as received."""
        return (*self.params, *self.params_567)

    @property
    def has_place(self) -> bool:
        """Whether latitude and longitude are given."""
        return isfinite(self.latitude_deg) and isfinite(self.longitude_deg)

    def altitude_amsl_m(self, home: GeodeticPoint | None) -> float:
        """The altitude above mean sea level; NaN when it is not given, or is relative to an unknown home."""
        if self.frame not in _RELATIVE_FRAMES:
            return self.altitude_m
        return nan if home is None else self.altitude_m + home.altitude_m


Handler = Callable[[Link, Message], None]
"""Takes a message received on a link."""

CommandHandler = Callable[[VehicleCommand], CommandResult | None]
"""Executes a command; None: it is not acknowledged."""

MissionCommandHandler = Callable[[SevenParams], CommandResult]
"""Executes a mission's command, with params 1 to 7."""

Source = Callable[[], Message | None]
"""Makes a message as it is now; None: it has no content yet."""

Reply = Callable[[Link, int], list[Message]]
"""Makes what REQUEST_MESSAGE requests on a link, with an index as its second parameter; empty: denied."""


class Service:
    """One MAVLink service of one of the vehicle's components.

    A service sets its tables in its constructor, and overrides `update` if it sends messages unrequested. No
    two services of a component have an entry for the same id.

    Attributes:
        component_id: of the component.
        handlers: by message id.
        commands: by MAV_CMD; they are acknowledged with the handler's result.
        mission_commands: by MAV_CMD; those of a mission to a device.
        sources: by message id; messages that can be streamed and requested.
        replies: by message id; messages that can only be requested.
        older_requests: by MAV_CMD, of requests older than REQUEST_MESSAGE: the message, and which of the
            command's parameters is its index; 0: none.
    """

    component_id: int = AUTOPILOT_COMPONENT_ID
    handlers: Mapping[int, Handler] = _EMPTY
    commands: Mapping[int, CommandHandler] = _EMPTY
    mission_commands: Mapping[int, MissionCommandHandler] = _EMPTY
    sources: Mapping[int, Source] = _EMPTY
    replies: Mapping[int, Reply] = _EMPTY
    older_requests: Mapping[int, tuple[int, int]] = _EMPTY

    def update(self) -> None:
        """Send what is due; called at every update of the node."""

    def repeat(self) -> None:
        """Send again what is sent regularly; called ten times a second while vehicle time stands."""


class AutopilotService(Service):
    """One that knows the autopilot, and by `exchange` the vehicle's links and time."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        self._autopilot = autopilot
        self._exchange = exchange


class DeviceComponent(AutopilotService):
    """A component beside the autopilot: it sends a heartbeat once a second, with the vehicle's mode.

    Attributes:
        kind: MAV_TYPE of its heartbeat.
    """

    kind: int

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        super().__init__(autopilot, exchange)
        self._heartbeat_due_us = 0

    def update(self) -> None:
        """Send the heartbeat, if it is due."""
        time_us = self._exchange.time_us
        if time_us < self._heartbeat_due_us:
            return
        self._heartbeat_due_us = time_us - time_us % _HEARTBEAT_US + _HEARTBEAT_US
        heartbeat = device_heartbeat(self.kind, self._autopilot.status.mode.custom_mode)
        self._exchange.broadcast(heartbeat, self.component_id)


def merged(tables: Iterable[Mapping[int, Entry]]) -> dict[int, Entry]:
    """All tables in one.

    Raises:
        ValueError: two of them have an entry for the same id.
    """
    all_entries: dict[int, Entry] = {}
    for table in tables:
        twice = all_entries.keys() & table.keys()
        if twice:
            raise ValueError(f"two tables have an entry for id {min(twice)}")
        all_entries.update(table)
    return all_entries
