"""The link to the vehicle before the app connects."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from math import inf

from framerunner.geometry.axes import Pose
from framerunner.wire.dialect import MAVSDK_SYSTEM_ID
from framerunner.wire.session.client import VehicleClient
from framerunner.wire.session.record import Record
from framerunner.wire.session.session import VehicleError
from framerunner.wire.transports.vehicle_link import VehicleLink
from offboard.link.place_feedback import PERIOD_US, PlaceFeedback

COMPONENT_ID = 190


def open_link(url: str) -> VehicleLink:
    """The link; the caller closes it.

    It has the app's system id: ArduPilot does not arm while it misses the ground station that flew it last.
    """
    return VehicleLink(url, system_id=MAVSDK_SYSTEM_ID, component_id=COMPONENT_ID)


@contextmanager
def open_client(
    url: str, cancelled: threading.Event | None = None, standing: Pose | None = None
) -> Iterator[VehicleClient]:
    """A vehicle that was found on a link, which is closed at the end.

    Args:
        url: of the link.
        cancelled: set by another thread to end all waiting.
        standing: arena axes, where the vehicle stands, if it is to be told that; see `PlaceSender`.

    Raises:
        LinkError: the address is bad, or the link cannot be opened.
        VehicleError: no vehicle is heard, or `cancelled` is set.
    """
    place, told_s = None if standing is None else PlaceFeedback(standing), -inf

    def progress(_what: str, _share: float) -> None:
        if cancelled is not None and cancelled.is_set():
            raise VehicleError("interrupted before arming")
        tell_place()

    def tell_place() -> None:
        nonlocal told_s
        now_s = time.monotonic()
        if place is not None and record.system_id is not None and now_s - told_s >= PERIOD_US * 1e-6:
            told_s = now_s
            record.send(place.standing(0))

    with closing(open_link(url)) as link:
        record = Record(MAVSDK_SYSTEM_ID, heartbeat="ground station")
        client = VehicleClient(link, record, time.monotonic, progress)
        client.find()
        yield client
