"""Writes a log of each flight, from arming to disarming (PX4's SDLOG_MODE 0), into the vehicle's storage.

A log can be read and downloaded while it is written; it is stored once a second.
"""

from __future__ import annotations

import errno
from collections.abc import Callable
from itertools import count

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.telemetry.connection import FOLLOWED_PX4_VERSION, OWN_VERSION, packed_version
from firmware_py.storage import LOG_SUFFIX, Path, Storage
from firmware_py.types import WARNING, StatusText
from firmware_py.ulog import ulog_messages
from firmware_py.ulog.topics import LOGGED, STATUS_TOPIC, Logged, LogSample

_FLUSH_US = 1_000_000
_LOG_FOLDER: Path = ("log",)
_GPS_DATA_FORMAT = 2  # vehicle_gps_position in degrees; for Flight Review

NameLog = Callable[[int], Path]
"""From the vehicle time in microseconds to the path of a log that begins then."""


def name_by_time(time_us: int) -> Path:
    """A log's path where the time of day is not known, as PX4's sess001/log001.ulg."""
    return ("log", "sess001", f"log{time_us // 1_000_000:06d}.ulg")


class UlogRecorder:
    """Records flights.

    Args:
        storage: of the logs; the oldest are removed when it is full.
        name_log: gives their paths.
        boot_unix_us: time of boot in microseconds since 1970; 0: not known.

    Attributes:
        path: of the log being written; None between flights.
    """

    def __init__(self, storage: Storage, name_log: NameLog = name_by_time, *, boot_unix_us: int = 0) -> None:
        self._storage = storage
        self._name_log = name_log
        self._boot_unix_us = boot_unix_us
        self.path: Path | None = None
        self._buffer = bytearray()
        self._size = 0
        self._paused = False  # until the next flight
        self._next_us = [0] * len(LOGGED)  # when each topic is due
        self._due_us = 0
        self._flush_us = 0
        self._recorded: Autopilot | None = None
        self._nav: tuple[object, ...] = ()

    def update(self, autopilot: Autopilot) -> None:
        """Log what is due; called every control tick, after the autopilot's step."""
        status = autopilot.status
        if self.path is None:
            if not status.armed:
                self._paused = False
                return
            if self._paused or autopilot.parameters.integer("SDLOG_MODE") < 0:
                return
            self._begin(autopilot)
        time_us = autopilot.state.time_us
        if not status.armed:
            self._end(autopilot, time_us)
            return
        nav = (status.mode, status.intended_mode, status.failsafe)
        if nav != self._nav:
            self._nav = nav
            self._log(STATUS_TOPIC, self._sample(autopilot, time_us))
        if time_us >= self._due_us:
            self._log_due(autopilot, time_us)
        if time_us >= self._flush_us:
            self._flush_us = time_us + _FLUSH_US
            self._flush(autopilot)

    def finish(self, autopilot: Autopilot) -> None:
        """End a log, when the program ends in flight."""
        if self.path is not None:
            self._end(autopilot, autopilot.state.time_us)

    def hear_text(self, time_us: int, said: StatusText) -> None:
        """Log a status text of a vehicle time; between flights it is dropped."""
        if self.path is not None:
            self._buffer += ulog_messages.logged_text(time_us, said.severity, said.text)

    def _log_parameter(self, name: str, value: float) -> None:
        if self.path is not None and self._recorded is not None:
            self._buffer += ulog_messages.parameter(self._recorded.parameters.declaration(name), value)

    def _begin(self, autopilot: Autopilot) -> None:
        if self._recorded is None:
            self._recorded = autopilot
            autopilot.parameters.on_change(self._log_parameter)
        time_us = autopilot.state.time_us
        self.path = self._unused(self._name_log(time_us))
        self._size = 0
        self._nav = ()
        self._due_us = self._flush_us = time_us
        self._next_us = [time_us] * len(LOGGED)
        self._buffer = bytearray(self._definitions(autopilot, time_us))

    def _unused(self, path: Path) -> Path:
        """The path, or one with a number: a log of an earlier flight, or a user's file, is never replaced."""
        *folder, name = path
        stem, _, suffix = name.rpartition(".")
        for number in count(2):
            try:
                self._storage.entry(path)
            except OSError:
                break
            path = (*folder, f"{stem}_{number}.{suffix}")
        return path

    def _definitions(self, autopilot: Autopilot, time_us: int) -> bytes:
        """Everything before the data."""
        parameters = autopilot.parameters
        own = ".".join(map(str, OWN_VERSION))
        system_id = parameters.integer("MAV_SYS_ID")
        parts = [ulog_messages.file_header(time_us)]
        parts += [
            ulog_messages.text_information("sys_name", "PX4"),
            ulog_messages.text_information("ver_hw", "PX4_SITL"),
            ulog_messages.text_information("ver_hw_subtype", f"framerunner {autopilot.airframe.name}"),
            ulog_messages.text_information("ver_sw", f"framerunner {own}"),
            ulog_messages.number_information("ver_sw_release", packed_version(FOLLOWED_PX4_VERSION)),
            ulog_messages.text_information("sys_os_name", "framerunner"),
            ulog_messages.number_information("sys_os_ver_release", packed_version(OWN_VERSION)),
            ulog_messages.text_information("sys_uuid", f"66726d72{system_id:08x}"),
            ulog_messages.number_information("ver_data_format", _GPS_DATA_FORMAT),
            ulog_messages.number_information("time_ref_utc", 0, "int32_t"),
        ]
        parts += [each.topic.definition() for each in LOGGED]
        for declared in parameters.declarations:
            value = parameters.value(declared.name)
            parts.append(ulog_messages.parameter(declared, value))
            if value != declared.default:
                parts.append(ulog_messages.parameter_default(declared))
        parts += [each.topic.subscription() for each in LOGGED]
        return b"".join(parts)

    def _end(self, autopilot: Autopilot, time_us: int) -> None:
        sample = self._sample(autopilot, time_us)
        for each in LOGGED:
            self._log(each, sample)
        self._flush(autopilot)
        self.path = None

    def _sample(self, autopilot: Autopilot, time_us: int) -> LogSample:
        unix_us = self._boot_unix_us + time_us if self._boot_unix_us else 0
        report = autopilot.estimator.report()
        return LogSample(autopilot, time_us, unix_us, autopilot.global_position(), report)

    def _log_due(self, autopilot: Autopilot, time_us: int) -> None:
        sample = self._sample(autopilot, time_us)
        for index, each in enumerate(LOGGED):
            next_us = self._next_us[index]
            if time_us >= next_us:
                self._next_us[index] = max(next_us + each.period_us, time_us - each.period_us)
                self._log(each, sample)
        self._due_us = min(self._next_us)

    def _log(self, logged: Logged, sample: LogSample) -> None:
        values = logged.collect(sample)
        if values is not None:
            self._buffer += logged.topic.header
            self._buffer += logged.topic.values.pack(*values)

    def _flush(self, autopilot: Autopilot) -> None:
        """Store the buffer; a log that was erased meanwhile is begun again."""
        path = self.path
        if path is None:
            return
        try:
            self._append(path)
        except FileNotFoundError:
            self._size = 0
            self._buffer = bytearray(self._definitions(autopilot, autopilot.state.time_us))
        except OSError as error:
            autopilot.say(WARNING, f"Logging stopped: {error.strerror or error}")
            self.path = None
            self._paused = True

    def _append(self, path: Path) -> None:
        while True:
            try:
                if self._size == 0:
                    self._make(path)
                self._storage.write(path, self._size, bytes(self._buffer))
            except OSError as error:
                if error.errno != errno.ENOSPC or not self._remove_oldest(path):
                    raise
            else:
                self._size += len(self._buffer)
                self._buffer.clear()
                return

    def _remove_oldest(self, current: Path) -> bool:
        """Remove the oldest log except the present one; return whether there was one."""
        for folder in self._storage.entries(_LOG_FOLDER):
            if not folder.is_folder:
                continue
            where = (*_LOG_FOLDER, folder.name)
            for log in self._storage.entries(where):
                path = (*where, log.name)
                if path != current and not log.is_folder and log.name.endswith(LOG_SUFFIX):
                    self._storage.remove(path)
                    return True
        return False

    def _make(self, path: Path) -> None:
        for depth in range(1, len(path)):
            try:
                self._storage.make_folder(path[:depth])
            except FileExistsError:
                continue
        self._storage.create(path)
