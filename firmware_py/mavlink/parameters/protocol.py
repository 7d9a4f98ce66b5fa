"""The parameter protocol: list, read, set, save; typed, integers bytewise, as PX4.

As PX4: `_HASH_CHECK` comes first in the list with index 65535, and setting it to the right value ends the
list (the ground station has all in its cache); nothing answers an unknown name or index or a wrong type; a
change is told on all links. Different: a value that cannot be is refused, with a text and the value kept.
"""

from __future__ import annotations

from collections.abc import Callable
from struct import pack, unpack

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import Command, Service
from firmware_py.parameters import Parameter, ParameterError
from firmware_py.status import CommandResult
from wire.dialect import Message, mavlink
from wire.exchange import Exchange
from wire.link import Link

HASH_NAME = "_HASH_CHECK"
_HASH_PLACE = -1  # in a list
_HASH_INDEX = 65535
BY_NAME = -1  # index in a request that gives a name
_PER_UPDATE = 4  # 1000 a second at 250 updates: PX4's pace, gentle to slow links
_LOAD, _SAVE, _RESET, _RESET_SENSORS, _RESET_ALL = 0, 1, 2, 3, 4  # PREFLIGHT_STORAGE_PARAMETER_ACTION
_QUIET_US = 5_000_000
TYPES = {"int32": mavlink.MAV_PARAM_TYPE_INT32, "float": mavlink.MAV_PARAM_TYPE_REAL32}
"""MAV_PARAM_TYPE; MAV_PARAM_EXT_TYPE has the same numbers."""


def _to_float(declared: Parameter, value: float) -> float:
    """A value as PARAM_VALUE carries it."""
    if declared.kind == "float":
        return value
    return float(unpack("<f", pack("<i", int(value)))[0])


def _from_float(declared: Parameter, value: float) -> float:
    """A value as PARAM_SET brought it."""
    return value if declared.kind == "float" else float(unpack("<i", pack("<f", value))[0])


class Refusals:
    """Says why a value was refused; once, as clients repeat what is not taken up to six times."""

    __slots__ = ("_autopilot", "_exchange", "_said", "_said_us")

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        self._autopilot = autopilot
        self._exchange = exchange
        self._said = ""
        self._said_us = -_QUIET_US

    def say(self, error: ParameterError) -> None:
        """Tell people, unless they have just been told."""
        now_us, text = self._exchange.time_us, f"Parameter refused: {error}"
        if text == self._said and now_us - self._said_us < _QUIET_US:
            return
        self._said, self._said_us = text, now_us
        self._autopilot.say(mavlink.MAV_SEVERITY_WARNING, text)


class Listings:
    """The lists under way, one a link.

    Args:
        count: of parameters.
        message: makes the message of an index.
        first: index with which a list begins; -1 where something comes before the parameters.
    """

    __slots__ = ("_count", "_exchange", "_first", "_message", "_next")

    def __init__(
        self, exchange: Exchange, count: int, message: Callable[[int], Message], first: int = 0
    ) -> None:
        self._exchange = exchange
        self._count = count
        self._message = message
        self._first = first
        self._next: dict[str, int] = {}  # by link name

    def begin(self, link: Link) -> None:
        """List all on a link, from the beginning."""
        self._next[link.profile.name] = self._first

    def end(self, link: Link) -> None:
        """List no more on a link."""
        self._next.pop(link.profile.name, None)

    def update(self) -> None:
        """Send the next few of each list."""
        if not self._next:
            return
        count = self._count
        for name, first in list(self._next.items()):
            link = self._exchange.links.get(name)
            if link is None:
                del self._next[name]
                continue
            if link.congested:
                continue
            after = min(first + _PER_UPDATE, count)
            for index in range(first, after):
                self._exchange.send(link, self._message(index))
            if after == count:
                del self._next[name]
            else:
                self._next[name] = after


class ParameterService(Service):
    """Answers for the parameters and sends the lists that were asked for."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        self._autopilot = autopilot
        self._parameters = autopilot.parameters
        self._exchange = exchange
        self._listings = Listings(exchange, len(self._parameters), self._message, _HASH_PLACE)
        self._refusals = Refusals(autopilot, exchange)
        self.handlers = {
            mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_LIST: self._list,
            mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ: self._read,
            mavlink.MAVLINK_MSG_ID_PARAM_SET: self._set,
        }
        self.commands = {mavlink.MAV_CMD_PREFLIGHT_STORAGE: self._preflight_storage}
        self._parameters.on_change(self._tell_change)

    def update(self) -> None:
        """Send the next few of each list."""
        self._listings.update()

    def _list(self, link: Link, message: Message) -> None:
        if self._exchange.is_for_us(message):
            self._listings.begin(link)

    def _read(self, link: Link, message: Message) -> None:
        if not self._exchange.is_for_us(message):
            return
        parameters = self._parameters
        index, name = message.param_index, message.param_id
        if index == BY_NAME:
            if name == HASH_NAME:
                self._exchange.send(link, self._hash_message())
                return
            if name not in parameters:
                return
            index = parameters.index(name)
        if 0 <= index < len(parameters):
            self._exchange.send(link, self._message(index))

    def _set(self, link: Link, message: Message) -> None:
        if not self._exchange.is_for_us(message):
            return
        parameters, name = self._parameters, message.param_id
        if name == HASH_NAME:
            if pack("<f", message.param_value) == pack("<I", parameters.hash()):
                self._listings.end(link)
            return
        if name not in parameters or message.param_type != TYPES[parameters.declaration(name).kind]:
            return
        version = parameters.version
        try:
            parameters.set(name, _from_float(parameters.declaration(name), message.param_value))
        except ParameterError as error:
            self._refusals.say(error)
        if parameters.version == version:  # nothing changed, so nothing was told yet
            self._exchange.broadcast(self._message(parameters.index(name)))

    def _tell_change(self, name: str, _value: float) -> None:
        self._exchange.broadcast(self._message(self._parameters.index(name)))

    def _message(self, index: int) -> Message:
        if index == _HASH_PLACE:
            return self._hash_message()
        parameters = self._parameters
        declared = parameters.declarations[index]
        value = _to_float(declared, parameters.value(declared.name))
        return mavlink.MAVLink_param_value_message(
            declared.name.encode(), value, TYPES[declared.kind], len(parameters), index
        )

    def _hash_message(self) -> Message:
        parameters = self._parameters
        value = unpack("<f", pack("<I", parameters.hash()))[0]
        return mavlink.MAVLink_param_value_message(
            HASH_NAME.encode(), value, mavlink.MAV_PARAM_TYPE_UINT32, len(parameters), _HASH_INDEX
        )

    def _preflight_storage(self, command: Command) -> CommandResult:
        """Save the parameters, or reset them to their defaults.

        Loading needs nothing done, as they are loaded at start, and neither does forgetting calibrations, as
        there are none. Where nothing is saved a text says how it would be.
        """
        action = command.params[0]
        if self._autopilot.status.armed:
            return CommandResult.TEMPORARILY_REJECTED
        if action in (_RESET, _RESET_ALL):
            self._parameters.reset()
            return CommandResult.ACCEPTED
        if action in (_LOAD, _RESET_SENSORS):
            return CommandResult.ACCEPTED
        if action != _SAVE:
            return CommandResult.DENIED
        if self._parameters.save():
            return CommandResult.ACCEPTED
        self._autopilot.say(
            mavlink.MAV_SEVERITY_WARNING, "Parameters are not saved: start it with --parameters FILE"
        )
        return CommandResult.FAILED
