"""The parameter protocol: list, read and set; typed, integers bytewise, as PX4.

As PX4: `_HASH_CHECK` comes first in the list with index 65535, and setting it to the right value ends the
list (the ground station has all in its cache); nothing answers an unknown name or index or a wrong type; a
change is told on all links. Different: a value that cannot be is refused, with a text and the value kept.
"""

from __future__ import annotations

from struct import pack, unpack

from firmware_py.mavlink.dialect import Message, mavlink
from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.parameters import Parameter, ParameterError

HASH_NAME = "_HASH_CHECK"
_HASH_INDEX = 65535
_BY_NAME = -1
_PER_UPDATE = 4  # 1000 a second at 250 updates: PX4's pace, gentle to slow links
_TYPES = {"int32": mavlink.MAV_PARAM_TYPE_INT32, "float": mavlink.MAV_PARAM_TYPE_REAL32}


class ParameterService:
    """Answers for the parameters and works off the lists that were asked for.

    Attributes:
        handlers: by message id.
    """

    __slots__ = ("_exchange", "_listing", "handlers")

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        self._listing: dict[str, int] = {}  # link name to next index; -1: the hash
        self.handlers: dict[int, Handler] = {
            mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_LIST: self._list,
            mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ: self._read,
            mavlink.MAVLINK_MSG_ID_PARAM_SET: self._set,
        }
        exchange.autopilot.parameters.on_change(self._tell_change)

    def update(self) -> None:
        """Send the next few of each list."""
        if not self._listing:
            return
        count = len(self._exchange.autopilot.parameters)
        for name, first in list(self._listing.items()):
            link = self._exchange.links.get(name)
            if link is None:
                del self._listing[name]
                continue
            if link.congested:
                continue
            after = min(first + _PER_UPDATE, count)
            for index in range(first, after):
                message = self._hash_message() if index < 0 else self._message(index)
                self._exchange.send(link, message)
            if after == count:
                del self._listing[name]
            else:
                self._listing[name] = after

    def _list(self, exchange: Exchange, link: Link, message: Message) -> None:
        if exchange.is_for_us(message):
            self._listing[link.profile.name] = -1

    def _read(self, exchange: Exchange, link: Link, message: Message) -> None:
        if not exchange.is_for_us(message):
            return
        parameters = exchange.autopilot.parameters
        index, name = message.param_index, message.param_id
        if index == _BY_NAME:
            if name == HASH_NAME:
                exchange.send(link, self._hash_message())
                return
            if name not in parameters:
                return
            index = parameters.index(name)
        if 0 <= index < len(parameters):
            exchange.send(link, self._message(index))

    def _set(self, exchange: Exchange, link: Link, message: Message) -> None:
        if not exchange.is_for_us(message):
            return
        parameters, name = exchange.autopilot.parameters, message.param_id
        if name == HASH_NAME:
            if pack("<f", message.param_value) == pack("<I", parameters.hash()):
                self._listing.pop(link.profile.name, None)
            return
        if name not in parameters or message.param_type != _TYPES[parameters.declaration(name).kind]:
            return
        version = parameters.version
        try:
            parameters.set(name, _decoded(message.param_value, parameters.declaration(name)))
        except ParameterError as error:
            exchange.autopilot.say(mavlink.MAV_SEVERITY_WARNING, f"Parameter refused: {error}")
        if parameters.version == version:  # nothing changed, so nothing was told yet
            exchange.broadcast(self._message(parameters.index(name)))

    def _tell_change(self, name: str, _value: float) -> None:
        self._exchange.broadcast(self._message(self._exchange.autopilot.parameters.index(name)))

    def _message(self, index: int) -> Message:
        parameters = self._exchange.autopilot.parameters
        declared = parameters.declarations[index]
        value = parameters.value(declared.name)
        if declared.kind == "int32":
            value = unpack("<f", pack("<i", int(value)))[0]
        return mavlink.MAVLink_param_value_message(
            declared.name.encode(), value, _TYPES[declared.kind], len(parameters), index
        )

    def _hash_message(self) -> Message:
        parameters = self._exchange.autopilot.parameters
        value = unpack("<f", pack("<I", parameters.hash()))[0]
        return mavlink.MAVLink_param_value_message(
            HASH_NAME.encode(), value, mavlink.MAV_PARAM_TYPE_UINT32, len(parameters), _HASH_INDEX
        )


def _decoded(value: float, declared: Parameter) -> float:
    return float(unpack("<i", pack("<f", value))[0]) if declared.kind == "int32" else value
