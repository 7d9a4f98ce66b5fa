"""The link to the vehicle before the app connects."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager

from framerunner.wire.dialect import MAVSDK_SYSTEM_ID
from framerunner.wire.session.client import VehicleClient
from framerunner.wire.session.record import Record
from framerunner.wire.session.session import VehicleError
from framerunner.wire.transports.vehicle_link import VehicleLink

COMPONENT_ID = 190


def open_link(url: str) -> VehicleLink:
    """The link; the caller closes it.

    It has the app's system id: ArduPilot does not arm while it misses the ground station that flew it last.
    """
    return VehicleLink(url, system_id=MAVSDK_SYSTEM_ID, component_id=COMPONENT_ID)


@contextmanager
def open_client(url: str, cancelled: threading.Event | None = None) -> Iterator[VehicleClient]:
    """A vehicle that was found on a link, which is closed at the end.

    Args:
        url: of the link.
        cancelled: set by another thread to end all waiting.

    Raises:
        LinkError: the address is bad, or the link cannot be opened.
        VehicleError: no vehicle is heard, or `cancelled` is set.
    """

    def progress(_what: str, _share: float) -> None:
        if cancelled is not None and cancelled.is_set():
            raise VehicleError("interrupted before arming")

    with closing(open_link(url)) as link:
        record = Record(MAVSDK_SYSTEM_ID, heartbeat="ground station")
        client = VehicleClient(link, record, time.monotonic, progress)
        client.find()
        yield client
