"""How values travel: typed, integers as their bytes inside a float (PARAM) or plain bytes (PARAM_EXT)."""

from __future__ import annotations

from struct import pack, unpack

from firmware_py.mavlink.exchange import Exchange
from firmware_py.parameters import Parameter, ParameterError
from wire.dialect import mavlink

TYPES = {"int32": mavlink.MAV_PARAM_TYPE_INT32, "float": mavlink.MAV_PARAM_TYPE_REAL32}
"""MAV_PARAM_TYPE; MAV_PARAM_EXT_TYPE has the same numbers."""

EXTENDED_BYTES = 128
_QUIET_US = 5_000_000


def to_float(declared: Parameter, value: float) -> float:
    """A value as PARAM_VALUE carries it."""
    if declared.kind == "float":
        return value
    return float(unpack("<f", pack("<i", int(value)))[0])


def from_float(declared: Parameter, value: float) -> float:
    """A value as PARAM_SET brought it."""
    return value if declared.kind == "float" else float(unpack("<i", pack("<f", value))[0])


def to_bytes(declared: Parameter, value: float) -> bytes:
    """A value as PARAM_EXT_VALUE carries it."""
    four = pack("<f", value) if declared.kind == "float" else pack("<i", int(value))
    return four.ljust(EXTENDED_BYTES, b"\0")


def from_bytes(declared: Parameter, data: bytes) -> float:
    """A value as PARAM_EXT_SET brought it; zeros at the end may be missing."""
    layout = "<f" if declared.kind == "float" else "<i"
    return float(unpack(layout, data[:4].ljust(4, b"\0"))[0])


class Refusals:
    """Says why a value was refused; once, as clients repeat what is not taken up to six times.

    Args:
        exchange: whose autopilot says it.
    """

    __slots__ = ("_exchange", "_said", "_said_us")

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        self._said = ""
        self._said_us = -_QUIET_US

    def say(self, error: ParameterError) -> None:
        """Tell people, unless they have just been told."""
        now_us, text = self._exchange.time_us, f"Parameter refused: {error}"
        if text == self._said and now_us - self._said_us < _QUIET_US:
            return
        self._said, self._said_us = text, now_us
        self._exchange.autopilot.say(mavlink.MAV_SEVERITY_WARNING, text)
