"""The connections of one MAVSDK instance, which forwards between all of them."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from pathlib import Path

import mavsdk.logging as native_log
from mavsdk.asyncio import Configuration, ForwardingOption, Mavsdk, MavsdkError
from mavsdk.asyncio.component_type import ComponentType

from framerunner.wire.status_text import plain
from framerunner.wire.transports.sockets import check_free
from framerunner.wire.transports.urls import LinkError, LinkUrl
from offboard.drone import DroneError
from offboard.link.companion import Companion
from offboard.link.tlog import TlogRecorder

logger = logging.getLogger(__name__)


def new_mavsdk() -> Mavsdk:
    """MAVSDK as a ground station, as PX4 sends the reasons of its refusals (STATUSTEXT) only to those.

    Its messages go to this module's logger, from its first one on.
    """
    native_log._cmavsdk_lib.mavsdk_log_subscribe(_log, None)
    return Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))


def check_is_free(url: LinkUrl, advice: str) -> None:
    """Raise DroneError, with advice, if another program listens at a drone's address."""
    try:
        check_free(url, advice)
    except LinkError as error:
        raise DroneError(str(error)) from None


async def open_connections(
    mavsdk: Mavsdk, urls: Sequence[str], tlog_path: Path | None, companion: Companion | None
) -> TlogRecorder | None:
    """Open the connections to recorder, companion, ground stations and vehicle.

    Args:
        mavsdk: gets the connections.
        urls: of ground stations, then of the vehicle.
        tlog_path: where all traffic is recorded; None: nowhere.
        companion: sends over the vehicle's link; None: there is none.

    Returns:
        The recorder, which the caller closes.

    Raises:
        DroneError: the vehicle's link or the recording cannot be opened.
    """
    recorder = None
    if tlog_path is not None:
        try:
            recorder = TlogRecorder(tlog_path)
            await mavsdk.add_any_connection(await recorder.listen(), ForwardingOption.ON)
        except (OSError, MavsdkError) as error:
            if recorder is not None:
                recorder.close()
            raise DroneError(f"cannot record to {tlog_path}: {error}") from None
    if companion is not None:
        try:
            await mavsdk.add_any_connection(companion.listen(), ForwardingOption.ON)
        except (OSError, MavsdkError) as error:  # the mission can be flown without
            logger.warning("the mission cannot be reported: %s", error)
    try:
        for url in urls:
            await mavsdk.add_any_connection(url, ForwardingOption.ON)
    except MavsdkError as error:
        if recorder is not None:
            recorder.close()
        raise DroneError(f"cannot open {urls[-1]}: {error}") from None
    return recorder


@native_log.LogCallback  # type: ignore[untyped-decorator]
def _log(level: int, message: bytes | None, _file: bytes | None, _line: int, _user: object) -> bool:
    """Take a message; MAVSDK prints one in which its own wrapper finds bytes that are no text."""
    logger.debug("mavsdk %d: %s", level, plain(message or b""))
    return True  # handled: MAVSDK prints nothing itself
