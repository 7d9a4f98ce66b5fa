"""Adds the addresses of other rooms, such as the editor's flights; each checks what a visitor may do."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from framerunner.monitor.server import Monitor


def register(monitor: Monitor) -> None:
    """Add the addresses of all extensions, and run them with the monitor."""
    for extension in monitor.equipment.extensions:
        monitor.web.include_router(extension.router(monitor.access.visitor))
        monitor.jobs.append(extension.run)
