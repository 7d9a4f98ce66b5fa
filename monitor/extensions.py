"""Adds the addresses of other rooms, such as the editor's flights; those who may fly may use them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from starlette.requests import HTTPConnection

if TYPE_CHECKING:
    from monitor.server import Monitor


def register(monitor: Monitor) -> None:
    """Add the addresses of all extensions, and run them with the monitor."""

    def may_act(connection: HTTPConnection) -> bool:
        return monitor.access.visitor(connection).may_fly

    for extension in monitor.equipment.extensions:
        monitor.web.include_router(extension.router(may_act))
        monitor.jobs.append(extension.run)
