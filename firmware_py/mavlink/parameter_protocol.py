"""The parameter protocol: list, read and set; typed, integers bytewise, as PX4.

As PX4: `_HASH_CHECK` comes first in the list with index 65535, and setting it to the right value ends the
list (the ground station has all in its cache); nothing answers an unknown name or index or a wrong type; a
change is told on all links. Different: a value that cannot be is refused, with a text and the value kept.
"""

from __future__ import annotations

from struct import pack, unpack

from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.parameter_listing import Listings
from firmware_py.mavlink.parameter_wire import TYPES, Refusals, from_float, to_float
from firmware_py.parameters import ParameterError
from wire.dialect import Message, mavlink

HASH_NAME = "_HASH_CHECK"
_HASH_PLACE = -1  # in a list
_HASH_INDEX = 65535
_BY_NAME = -1


class ParameterService:
    """Answers for the parameters and works off the lists that were asked for.

    Attributes:
        handlers: by message id.
    """

    __slots__ = ("_exchange", "_listings", "_refusals", "handlers")

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        self._listings = Listings(exchange, self._message, _HASH_PLACE)
        self._refusals = Refusals(exchange)
        self.handlers: dict[int, Handler] = {
            mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_LIST: self._list,
            mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ: self._read,
            mavlink.MAVLINK_MSG_ID_PARAM_SET: self._set,
        }
        exchange.autopilot.parameters.on_change(self._tell_change)

    def update(self) -> None:
        """Send the next few of each list."""
        self._listings.update()

    def _list(self, exchange: Exchange, link: Link, message: Message) -> None:
        if exchange.is_for_us(message):
            self._listings.begin(link)

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
                self._listings.end(link)
            return
        if name not in parameters or message.param_type != TYPES[parameters.declaration(name).kind]:
            return
        version = parameters.version
        try:
            parameters.set(name, from_float(parameters.declaration(name), message.param_value))
        except ParameterError as error:
            self._refusals.say(error)
        if parameters.version == version:  # nothing changed, so nothing was told yet
            exchange.broadcast(self._message(parameters.index(name)))

    def _tell_change(self, name: str, _value: float) -> None:
        self._exchange.broadcast(self._message(self._exchange.autopilot.parameters.index(name)))

    def _message(self, index: int) -> Message:
        if index == _HASH_PLACE:
            return self._hash_message()
        parameters = self._exchange.autopilot.parameters
        declared = parameters.declarations[index]
        value = to_float(declared, parameters.value(declared.name))
        return mavlink.MAVLink_param_value_message(
            declared.name.encode(), value, TYPES[declared.kind], len(parameters), index
        )

    def _hash_message(self) -> Message:
        parameters = self._exchange.autopilot.parameters
        value = unpack("<f", pack("<I", parameters.hash()))[0]
        return mavlink.MAVLink_param_value_message(
            HASH_NAME.encode(), value, mavlink.MAV_PARAM_TYPE_UINT32, len(parameters), _HASH_INDEX
        )
