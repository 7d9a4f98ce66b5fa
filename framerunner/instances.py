"""Instances of the simulated drone, which shift its ports: one that is free is found and claimed."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import gettempdir

from filelock import FileLock

from framerunner.errors import SettingError
from framerunner.wire.transports.sockets import bind_udp, listen_tcp
from framerunner.wire.transports.urls import LinkError
from sitl.ardupilot import json_interface as ardupilot
from sitl.ardupilot.relay import RELAY_PORT
from sitl.ardupilot.sensor_link import SENSOR_PORT
from sitl.px4 import link as px4
from sitl.px4.side_link import CAMERA_PORT
from sitl.server_settings import VIDEO_PORT

INSTANCES = 10
_TCP_PORTS = (px4.FIRST_PORT, VIDEO_PORT)
_UDP_PORTS = (14280, 14540, 14580, 18570, CAMERA_PORT)  # of the app, and PX4's own
_ARDUPILOT_UDP_PORTS = (ardupilot.FIRST_PORT, SENSOR_PORT, RELAY_PORT)
_PX4_LOCKS = "/tmp/px4_lock-"  # PX4's own; an instance is one PX4's on this machine


@contextmanager
def claimed_instance() -> Iterator[int]:
    """An instance whose ports are free, and which no other flight of this machine claims meanwhile.

    Raises:
        SettingError: there is none.
    """
    for instance in range(INSTANCES):
        path = Path(gettempdir()) / f"framerunner-instance-{instance}.lock"
        try:
            # Every user of this machine may take it, and a thread may give back what another one claimed.
            lock = FileLock(path, timeout=0, mode=0o666, thread_local=False).acquire()
        except OSError:  # it is claimed, or its name is taken by something else
            continue
        with lock:
            if _is_free(instance):
                yield instance
                return
    raise SettingError(f"the ports of all {INSTANCES} instances are in use; end other simulators or flights")


def _is_free(instance: int) -> bool:
    """Whether no program has one of its ports, and no PX4 its lock."""
    if _is_locked_by_px4(instance):
        return False
    try:
        for port in _TCP_PORTS:
            listen_tcp(("127.0.0.1", port + instance), patience_s=0.0).close()
        shift = ardupilot.PORTS_AN_INSTANCE * instance
        shifted = [port + shift for port in _ARDUPILOT_UDP_PORTS]
        for port in (*(port + instance for port in _UDP_PORTS), *shifted):
            bind_udp(("127.0.0.1", port), "", patience_s=0.0).close()
    except LinkError:
        return False
    return True


def _is_locked_by_px4(instance: int) -> bool:
    """Whether a PX4 of this instance runs: it has a record lock on a file, whoever has started it."""
    try:  # a link is refused, and a pipe is not waited for
        file = os.open(f"{_PX4_LOCKS}{instance}", os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        with os.fdopen(file, "rb"):
            fcntl.lockf(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return False
