"""The socket the monitor listens on."""

from __future__ import annotations

import socket

from monitor.settings import MonitorError

BACKLOG = 100  # connections accepted at once; must leave room below the limit of open files
_MOST_UNSENT_BYTES = 1 << 16  # that the kernel takes for a slow viewer, beyond what is on its way


def listen(bind: str, port: int) -> socket.socket:
    """Open the listening socket, before anything slow is done: so a taken port is told at once.

    Args:
        bind: address or name of an interface.
        port: TCP port; 0 lets the system choose.

    Raises:
        MonitorError: it is taken, or the address is not ours.
    """
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(
            bind, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
        listener = socket.socket(family, kind, protocol)
    except OSError as error:
        raise MonitorError(
            f"monitor: --bind {bind}: {(error.strerror or str(error)).lower()}; "
            "give an address of this machine, such as 127.0.0.1 or 0.0.0.0"
        ) from error
    try:
        listener.setsockopt(
            socket.SOL_SOCKET, socket.SO_REUSEADDR, 1
        )  # a killed monitor's port is free at once
        if hasattr(socket, "TCP_NOTSENT_LOWAT"):
            listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, _MOST_UNSENT_BYTES)
        listener.bind(address)
        listener.listen(BACKLOG)
        listener.setblocking(False)
    except OSError as error:
        listener.close()
        reason = (error.strerror or str(error)).lower()
        raise MonitorError(
            f"monitor: cannot listen on {bind} port {port}: {reason}; choose another with --port"
        ) from error
    return listener
