"""The extended parameter protocol, PARAM_EXT_*: the same parameters for clients that prefer it.

PX4's autopilot leaves these unanswered. Every set is acknowledged here, with the value that is kept; a change
is told on all links by the plain protocol.
"""

from __future__ import annotations

from struct import pack, unpack

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.parameters.protocol import BY_NAME, TYPES, Listings, Refusals
from firmware_py.mavlink.service import Service
from firmware_py.parameters import Parameter, ParameterError
from wire.dialect import Message, mavlink
from wire.exchange import Exchange
from wire.link import Link

_VALUE_BYTES = 128


class ExtendedParameterService(Service):
    """Answers for the parameters."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        self._parameters = autopilot.parameters
        self._exchange = exchange
        self._listings = Listings(exchange, len(self._parameters), self._message)
        self._refusals = Refusals(autopilot, exchange)
        self.handlers = {
            mavlink.MAVLINK_MSG_ID_PARAM_EXT_REQUEST_LIST: self._list,
            mavlink.MAVLINK_MSG_ID_PARAM_EXT_REQUEST_READ: self._read,
            mavlink.MAVLINK_MSG_ID_PARAM_EXT_SET: self._set,
        }

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
        index = message.param_index
        if index == BY_NAME and message.param_id in parameters:
            index = parameters.index(message.param_id)
        if 0 <= index < len(parameters):
            self._exchange.send(link, self._message(index))

    def _set(self, link: Link, message: Message) -> None:
        parameters, name = self._parameters, message.param_id
        if not self._exchange.is_for_us(message) or name not in parameters:
            return
        declared = parameters.declaration(name)
        result = mavlink.PARAM_ACK_ACCEPTED
        if message.param_type != TYPES[declared.kind]:
            result = mavlink.PARAM_ACK_VALUE_UNSUPPORTED
        else:
            try:
                parameters.set(name, _from_bytes(declared, message._param_value_raw))
            except ParameterError as error:
                result = mavlink.PARAM_ACK_VALUE_UNSUPPORTED
                self._refusals.say(error)
        kept = _to_bytes(declared, parameters.value(name))
        answer = mavlink.MAVLink_param_ext_ack_message(name.encode(), kept, TYPES[declared.kind], result)
        self._exchange.send(link, answer)

    def _message(self, index: int) -> Message:
        parameters = self._parameters
        declared = parameters.declarations[index]
        value = _to_bytes(declared, parameters.value(declared.name))
        return mavlink.MAVLink_param_ext_value_message(
            declared.name.encode(), value, TYPES[declared.kind], len(parameters), index
        )


def _to_bytes(declared: Parameter, value: float) -> bytes:
    """A value as PARAM_EXT_VALUE carries it."""
    four = pack("<f", value) if declared.kind == "float" else pack("<i", int(value))
    return four.ljust(_VALUE_BYTES, b"\0")


def _from_bytes(declared: Parameter, data: bytes) -> float:
    """A value as PARAM_EXT_SET brought it; zeros at the end may be missing."""
    layout = "<f" if declared.kind == "float" else "<i"
    return float(unpack(layout, data[:4].ljust(4, b"\0"))[0])
