"""A command, whichever message brought it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite, nan

from firmware_py.mavlink.exchange import Exchange
from firmware_py.mavlink.links import Link
from firmware_py.status import CommandResult
from firmware_py.types import GeodeticPoint
from wire.dialect import Message, mavlink

_NOT_GIVEN = 0x7FFFFFFF  # of x and y in COMMAND_INT
_RELATIVE_FRAMES = (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)


@dataclass(frozen=True, slots=True)
class Command:
    """What COMMAND_LONG and COMMAND_INT say; NaN means "not given".

    Attributes:
        link: it came by.
        params: params 1 to 4.
        latitude_deg: param 5 or x.
        longitude_deg: param 6 or y.
        altitude_m: param 7 or z; above mean sea level unless the frame says above home.
        frame: MAV_FRAME of COMMAND_INT.
        params_567: params 5 to 7 as they came, for commands in which they are no place.
    """

    link: Link
    params: tuple[float, float, float, float]
    latitude_deg: float = nan
    longitude_deg: float = nan
    altitude_m: float = nan
    frame: int = mavlink.MAV_FRAME_GLOBAL
    params_567: tuple[float, float, float] = (nan, nan, nan)

    @property
    def has_place(self) -> bool:
        """Whether latitude and longitude are given."""
        return isfinite(self.latitude_deg) and isfinite(self.longitude_deg)

    def altitude_amsl_m(self, home: GeodeticPoint | None) -> float:
        """The altitude above mean sea level; NaN when it is not given or counts from a home not known."""
        if self.frame not in _RELATIVE_FRAMES:
            return self.altitude_m
        return nan if home is None else self.altitude_m + home.altitude_m


CommandHandler = Callable[[Exchange, Command], "CommandResult | None"]
"""Does a command; None: it is not acknowledged."""


def from_long(link: Link, message: Message) -> Command:
    """The command of a COMMAND_LONG."""
    p5, p6, p7 = message.param5, message.param6, message.param7
    params = (message.param1, message.param2, message.param3, message.param4)
    return Command(link, params, p5, p6, p7, params_567=(p5, p6, p7))


def from_int(link: Link, message: Message) -> Command:
    """The command of a COMMAND_INT."""
    params = (message.param1, message.param2, message.param3, message.param4)
    return Command(
        link,
        params,
        _degrees(message.x),
        _degrees(message.y),
        message.z,
        message.frame,
        (float(message.x), float(message.y), message.z),
    )


def _degrees(e7: int) -> float:
    return nan if e7 == _NOT_GIVEN else e7 / 1e7
