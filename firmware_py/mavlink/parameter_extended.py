"""The extended parameter protocol, PARAM_EXT_*: the same parameters for clients that prefer it.

PX4's autopilot leaves these unanswered. Every set is acknowledged here, with the value that is kept; a change
is told on all links by the plain protocol.
"""

from __future__ import annotations

from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.parameter_listing import Listings
from firmware_py.mavlink.parameter_wire import TYPES, Refusals, from_bytes, to_bytes
from firmware_py.parameters import ParameterError
from wire.dialect import Message, mavlink

_BY_NAME = -1


class ExtendedParameterService:
    """Answers for the parameters.

    Attributes:
        handlers: by message id.
    """

    __slots__ = ("_exchange", "_listings", "_refusals", "handlers")

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        self._listings = Listings(exchange, self._message)
        self._refusals = Refusals(exchange)
        self.handlers: dict[int, Handler] = {
            mavlink.MAVLINK_MSG_ID_PARAM_EXT_REQUEST_LIST: self._list,
            mavlink.MAVLINK_MSG_ID_PARAM_EXT_REQUEST_READ: self._read,
            mavlink.MAVLINK_MSG_ID_PARAM_EXT_SET: self._set,
        }

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
        index = message.param_index
        if index == _BY_NAME and message.param_id in parameters:
            index = parameters.index(message.param_id)
        if 0 <= index < len(parameters):
            exchange.send(link, self._message(index))

    def _set(self, exchange: Exchange, link: Link, message: Message) -> None:
        parameters, name = exchange.autopilot.parameters, message.param_id
        if not exchange.is_for_us(message) or name not in parameters:
            return
        declared = parameters.declaration(name)
        result = mavlink.PARAM_ACK_ACCEPTED
        if message.param_type != TYPES[declared.kind]:
            result = mavlink.PARAM_ACK_VALUE_UNSUPPORTED
        else:
            try:
                parameters.set(name, from_bytes(declared, message._param_value_raw))
            except ParameterError as error:
                result = mavlink.PARAM_ACK_VALUE_UNSUPPORTED
                self._refusals.say(error)
        kept = to_bytes(declared, parameters.value(name))
        answer = mavlink.MAVLink_param_ext_ack_message(name.encode(), kept, TYPES[declared.kind], result)
        exchange.send(link, answer)

    def _message(self, index: int) -> Message:
        parameters = self._exchange.autopilot.parameters
        declared = parameters.declarations[index]
        value = to_bytes(declared, parameters.value(declared.name))
        return mavlink.MAVLink_param_ext_value_message(
            declared.name.encode(), value, TYPES[declared.kind], len(parameters), index
        )
