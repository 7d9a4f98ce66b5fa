"""PX4's dialect in a simulation whose time waits for this app."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Mapping
from types import MappingProxyType
from typing import Any

from framerunner.wire import px4_modes
from framerunner.wire.dialect import mavlink
from framerunner.wire.px4_modes import Px4Mode
from offboard.drone import ResponsePrior
from offboard.link.dialect import PX4_MODES, PX4_READY_LIMIT_S
from offboard.link.stepped import SteppedDialect

_TAKEN_S = 0.3  # wall time in which PX4 takes a request that it cannot return a PING after
_POSITIONS_HZ = 50.0


def _parameters(mode: Px4Mode) -> tuple[float, ...]:
    """Those of the MAV_CMD that requests a mode."""
    return (1.0, float(mode.main), float(mode.sub))


class SteppedPx4Dialect(SteppedDialect):
    """One PX4, which returns PINGs itself; see `SteppedDialect`."""

    NAME = "PX4"
    OFFBOARD = _parameters(px4_modes.OFFBOARD)
    HOLD = _parameters(px4_modes.HOLD)
    LAND = _parameters(px4_modes.LAND)

    modes = PX4_MODES
    numbered_modes: Mapping[int, str] = MappingProxyType({})
    response_prior = ResponsePrior.LATE
    checks_in_offboard = False
    ready_limit_s = PX4_READY_LIMIT_S

    def __init__(self, direct: Any, system_id: int) -> None:  # noqa: ANN401 - MAVSDK is untyped
        super().__init__(direct, system_id)
        self._interval_requested = False  # since the last tick

    def request_streams(self) -> Awaitable[None]:
        """Request positions as often as the app uses them.

        PX4's thread that receives messages waits then, until time has gone on.
        """
        self._interval_requested = True
        interval_us = 1e6 / _POSITIONS_HZ
        number = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
        return self._request(number, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, interval_us)

    async def _until_taken(self) -> None:
        if self._interval_requested:
            self._interval_requested = False
            await asyncio.sleep(_TAKEN_S)
        else:
            await super()._until_taken()
