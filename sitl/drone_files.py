"""What a served drone writes among its files: flight logs."""

from __future__ import annotations

from datetime import UTC, datetime

from firmware_py.storage import Path, Storage
from firmware_py.ulog import UlogRecorder


def _utc(unix_us: int, form: str) -> str:
    return datetime.fromtimestamp(unix_us / 1e6, UTC).strftime(form)


def flight_recorder(storage: Storage, boot_unix_us: int) -> UlogRecorder:
    """A recorder that names logs as PX4 does, `log/2026-11-20/14_05_59.ulg` (UTC).

    Args:
        storage: where the logs are written.
        boot_unix_us: time of boot in microseconds since 1970.
    """

    def name_log(time_us: int) -> Path:
        began_us = boot_unix_us + time_us
        return ("log", _utc(began_us, "%Y-%m-%d"), _utc(began_us, "%H_%M_%S.ulg"))

    return UlogRecorder(storage, name_log, boot_unix_us=boot_unix_us)
