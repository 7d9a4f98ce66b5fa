"""A served drone's files: where they are kept, and its flight logs among them."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path as DiskPath

from firmware_py.storage import Path, Storage
from firmware_py.ulog import UlogRecorder
from sitl.storage import MemoryStorage
from sitl.storage_folder import FolderStorage


def open_storage(folder: DiskPath | None, instance: int) -> MemoryStorage | FolderStorage:
    """Where an instance keeps its files.

    Args:
        folder: each instance has the folder of its number in it, as PX4's simulations have; None: in memory,
            and gone with the program.
        instance: of the drone.

    Raises:
        StorageFolderError: the folder cannot be used.
    """
    return MemoryStorage() if folder is None else FolderStorage(folder / str(instance))


def flight_recorder(storage: Storage, boot_unix_us: int) -> UlogRecorder:
    """A recorder that calls logs as PX4 does, `log/2026-11-20/14_05_59.ulg` (UTC).

    Args:
        storage: where they go.
        boot_unix_us: time of boot in microseconds since 1970.
    """

    def name_log(time_us: int) -> Path:
        began = datetime.fromtimestamp((boot_unix_us + time_us) / 1e6, UTC)
        return ("log", began.strftime("%Y-%m-%d"), began.strftime("%H_%M_%S.ulg"))

    return UlogRecorder(storage, name_log, boot_unix_us=boot_unix_us)
