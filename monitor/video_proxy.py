"""`/video/ID`: a drone's MJPEG passed on, over one connection to the drone however many watch."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from monitor.server import Monitor


def register(monitor: Monitor) -> None:
    """Add `/video/ID` and `/video/ID/image.jpg`."""
