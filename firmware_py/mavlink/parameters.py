"""The parameter protocols PARAM_* and PARAM_EXT_*: list, read, set, save.

PARAM_*: values are typed, integers are sent bytewise. As PX4: `_HASH_CHECK` is the first entry of the list,
with index 65535, and setting it to the right value ends the list (the ground station has all in its
cache); an unknown name or index or a wrong type is not answered; a change is sent on all links. Different:
an invalid value is refused, with a text and the value kept.

PARAM_EXT_*, which PX4's autopilot does not answer: the same parameters. Every set is acknowledged with the
value that is kept; a change is sent on all links as PARAM_VALUE.
"""

from __future__ import annotations

from struct import pack, unpack

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import AutopilotService, VehicleCommand
from firmware_py.parameters import Parameter, ParameterError
from firmware_py.status import CommandResult
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

HASH_NAME = "_HASH_CHECK"
_HASH_POSITION = -1  # in a list
_HASH_INDEX = 65535
_BY_NAME = -1  # index in a request that gives a name
_PER_UPDATE = 4  # 1000 a second at 250 updates, as PX4
_LOAD, _SAVE, _RESET, _RESET_SENSORS, _RESET_ALL = 0, 1, 2, 3, 4  # PREFLIGHT_STORAGE_PARAMETER_ACTION
_REPEAT_TEXT_US = 5_000_000
_TYPES = {
    "int32": mavlink.MAV_PARAM_TYPE_INT32,
    "float": mavlink.MAV_PARAM_TYPE_REAL32,
}  # MAV_PARAM_EXT_TYPE too
_EXTENDED_BYTES = 128


class _ParameterProtocol(AutopilotService):
    """What both protocols share: one list at a time on each link, and the reasons for refusals as texts."""

    _first_index = 0  # of a list

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        super().__init__(autopilot, exchange)
        self._parameters = autopilot.parameters
        self._next_index: dict[str, int] = {}  # of the lists being sent, by link name
        self._refusal = ""
        self._refusal_us = -_REPEAT_TEXT_US

    def update(self) -> None:
        """Send the next few entries of each list."""
        if not self._next_index:
            return
        count = len(self._parameters)
        for name, first in list(self._next_index.items()):
            link = self._exchange.links.get(name)
            if link is None:
                del self._next_index[name]
                continue
            if link.congested:
                continue
            after = min(first + _PER_UPDATE, count)
            for index in range(first, after):
                self._exchange.send(link, self._value_message(index))
            if after == count:
                del self._next_index[name]
            else:
                self._next_index[name] = after

    def _value_message(self, index: int) -> Message:
        raise NotImplementedError

    def _request_list(self, link: Link, message: Message) -> None:
        if self._exchange.is_for_us(message):
            self._next_index[link.profile.name] = self._first_index

    def _request_read(self, link: Link, message: Message) -> None:
        if not self._exchange.is_for_us(message):
            return
        parameters, index = self._parameters, message.param_index
        if index == _BY_NAME and message.param_id in parameters:
            index = parameters.index(message.param_id)
        if 0 <= index < len(parameters):
            self._exchange.send(link, self._value_message(index))

    def _report_refusal(self, error: ParameterError) -> None:
        """Report why a value was refused; once, as clients repeat such a set up to six times."""
        now_us, text = self._exchange.time_us, f"Parameter refused: {error}"
        if text != self._refusal or now_us - self._refusal_us >= _REPEAT_TEXT_US:
            self._refusal, self._refusal_us = text, now_us
            self._autopilot.say(mavlink.MAV_SEVERITY_WARNING, text)


class ParameterService(_ParameterProtocol):
    """PARAM_* and PREFLIGHT_STORAGE."""

    _first_index = _HASH_POSITION

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        super().__init__(autopilot, exchange)
        self.handlers = {
            mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_LIST: self._request_list,
            mavlink.MAVLINK_MSG_ID_PARAM_REQUEST_READ: self._request_read,
            mavlink.MAVLINK_MSG_ID_PARAM_SET: self._set,
        }
        self.commands = {mavlink.MAV_CMD_PREFLIGHT_STORAGE: self._preflight_storage}
        self._parameters.on_change(self._broadcast_change)

    def _request_read(self, link: Link, message: Message) -> None:
        if message.param_index != _BY_NAME or message.param_id != HASH_NAME:
            super()._request_read(link, message)
        elif self._exchange.is_for_us(message):
            self._exchange.send(link, self._hash_message())

    def _set(self, link: Link, message: Message) -> None:
        if not self._exchange.is_for_us(message):
            return
        parameters, name = self._parameters, message.param_id
        if name == HASH_NAME:
            if pack("<f", message.param_value) == pack("<I", parameters.hash()):
                self._next_index.pop(link.profile.name, None)
            return
        if name not in parameters or message.param_type != _TYPES[parameters.declaration(name).kind]:
            return
        version = parameters.version
        try:
            parameters.set(name, _decoded(parameters.declaration(name), pack("<f", message.param_value)))
        except ParameterError as error:
            self._report_refusal(error)
        if parameters.version == version:  # nothing changed, so nothing was sent yet
            self._exchange.broadcast(self._value_message(parameters.index(name)))

    def _broadcast_change(self, name: str, _value: float) -> None:
        self._exchange.broadcast(self._value_message(self._parameters.index(name)))

    def _value_message(self, index: int) -> Message:
        if index == _HASH_POSITION:
            return self._hash_message()
        parameters = self._parameters
        declared = parameters.declarations[index]
        (value,) = unpack("<f", _encoded(declared, parameters.value(declared.name)))
        return mavlink.MAVLink_param_value_message(
            declared.name.encode(), value, _TYPES[declared.kind], len(parameters), index
        )

    def _hash_message(self) -> Message:
        parameters = self._parameters
        value = unpack("<f", pack("<I", parameters.hash()))[0]
        return mavlink.MAVLink_param_value_message(
            HASH_NAME.encode(), value, mavlink.MAV_PARAM_TYPE_UINT32, len(parameters), _HASH_INDEX
        )

    def _preflight_storage(self, command: VehicleCommand) -> CommandResult:
        """Save the parameters, or reset them to their defaults.

        Loading does nothing, as they are loaded at start, and neither does resetting calibrations, as there
        are none. Where nothing can be saved a text says how to change that.
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


class ExtendedParameterService(_ParameterProtocol):
    """PARAM_EXT_*."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        super().__init__(autopilot, exchange)
        self.handlers = {
            mavlink.MAVLINK_MSG_ID_PARAM_EXT_REQUEST_LIST: self._request_list,
            mavlink.MAVLINK_MSG_ID_PARAM_EXT_REQUEST_READ: self._request_read,
            mavlink.MAVLINK_MSG_ID_PARAM_EXT_SET: self._set,
        }

    def _set(self, link: Link, message: Message) -> None:
        parameters, name = self._parameters, message.param_id
        if not self._exchange.is_for_us(message) or name not in parameters:
            return
        declared = parameters.declaration(name)
        result = mavlink.PARAM_ACK_ACCEPTED
        if message.param_type != _TYPES[declared.kind]:
            result = mavlink.PARAM_ACK_VALUE_UNSUPPORTED
        else:
            try:
                parameters.set(name, _decoded(declared, message._param_value_raw))
            except ParameterError as error:
                result = mavlink.PARAM_ACK_VALUE_UNSUPPORTED
                self._report_refusal(error)
        kept = _encoded(declared, parameters.value(name)).ljust(_EXTENDED_BYTES, b"\0")
        answer = mavlink.MAVLink_param_ext_ack_message(name.encode(), kept, _TYPES[declared.kind], result)
        self._exchange.send(link, answer)

    def _value_message(self, index: int) -> Message:
        parameters = self._parameters
        declared = parameters.declarations[index]
        value = _encoded(declared, parameters.value(declared.name)).ljust(_EXTENDED_BYTES, b"\0")
        return mavlink.MAVLink_param_ext_value_message(
            declared.name.encode(), value, _TYPES[declared.kind], len(parameters), index
        )


def _encoded(declared: Parameter, value: float) -> bytes:
    """A value as four bytes: a float, or an integer."""
    return pack("<f", value) if declared.kind == "float" else pack("<i", int(value))


def _decoded(declared: Parameter, data: bytes) -> float:
    """The value of the first four bytes; zeros at the end may be missing."""
    layout = "<f" if declared.kind == "float" else "<i"
    return float(unpack(layout, data[:4].ljust(4, b"\0"))[0])
