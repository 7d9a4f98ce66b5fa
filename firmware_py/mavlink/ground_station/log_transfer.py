"""Log download: LOG_REQUEST_LIST, LOG_REQUEST_DATA, LOG_REQUEST_END and LOG_ERASE, as PX4 answers them.

Logs are the files in the folders of `log/`, numbered from 0 in the order of their names, until the list is
requested again. Different from PX4: without any log one LOG_ENTRY reports that (PX4 is silent, and clients
wait for their time-out), data can be requested before the list, a list ends with the requested number, and
requests to another vehicle are ignored.
"""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field

from firmware_py.mavlink.service import Service
from firmware_py.storage import LOG_SUFFIX, Path, Storage
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

LOG_FOLDER: Path = ("log",)
_CHUNK = 90
_PACKETS = 8  # per link and update: 180 kB/s at 250 updates a second
_LAST = 0xFFFF
_MAX_LOGS = 1000


@dataclass(frozen=True, slots=True)
class _Log:
    path: Path
    size: int
    time_utc_s: int


@dataclass(slots=True)
class _Transfer:
    """What is to be sent on one link."""

    requested: tuple[int, int] | None = None  # first and last number of a list
    entries: deque[Message] = field(default_factory=deque)  # LOG_ENTRY
    log: _Log | None = None  # whose data is sent
    number: int = 0  # of that log
    offset: int = 0  # of the next data
    end: int = 0  # of the data


class LogTransferService(Service):
    """Lists and sends the logs in `storage`; None: there are none."""

    def __init__(self, exchange: Exchange, storage: Storage | None) -> None:
        self._exchange = exchange
        self._storage = storage
        self._logs: list[_Log] | None = None
        self._transfers: dict[str, _Transfer] = {}  # unfinished ones, by link
        self.handlers = {
            mavlink.MAVLINK_MSG_ID_LOG_REQUEST_LIST: self._list,
            mavlink.MAVLINK_MSG_ID_LOG_REQUEST_DATA: self._data,
            mavlink.MAVLINK_MSG_ID_LOG_REQUEST_END: self._end,
            mavlink.MAVLINK_MSG_ID_LOG_ERASE: self._erase,
        }

    def update(self) -> None:
        """Send the next few packets of each transfer."""
        for name, transfer in list(self._transfers.items()):
            link = self._exchange.links.get(name)
            if link is None or not self._continue(link, transfer):
                del self._transfers[name]

    def _continue(self, link: Link, transfer: _Transfer) -> bool:
        """Send a few packets; whether the transfer is unfinished."""
        if transfer.requested is not None:
            self._make_list(transfer, *transfer.requested)
            transfer.requested = None
        for _ in range(_PACKETS):
            if link.congested:
                break
            if transfer.entries:
                self._exchange.send(link, transfer.entries.popleft())
            elif transfer.log is not None:
                self._send_data(link, transfer, transfer.log)
            else:
                return False
        return True

    def _send_data(self, link: Link, transfer: _Transfer, log: _Log) -> None:
        count = min(_CHUNK, transfer.end - transfer.offset)
        data = b""
        if self._storage is not None:
            with suppress(OSError):  # erased or renamed meanwhile
                data = self._storage.read(log.path, transfer.offset, count)
        if data:
            chunk = data.ljust(_CHUNK, b"\0")
            self._exchange.send(
                link, mavlink.MAVLink_log_data_message(transfer.number, transfer.offset, len(data), chunk)
            )
        transfer.offset += len(data)
        if not data or transfer.offset >= transfer.end:
            transfer.log = None

    def _list(self, link: Link, message: Message) -> None:
        if not self._exchange.is_for_us(message, or_everyone=True):
            return
        transfer = self._transfers.setdefault(link.profile.name, _Transfer())
        transfer.requested, transfer.log = (message.start, message.end), None

    def _make_list(self, transfer: _Transfer, first: int, end: int) -> None:
        """Make the list at the next update, when the log of a flight that has just ended is complete."""
        self._logs = logs = self._find()
        transfer.entries.clear()
        if not logs:
            transfer.entries.append(mavlink.MAVLink_log_entry_message(0, 0, 0, 0, 0))
        last = len(logs) if end == _LAST else end  # as PX4 fills last_log_num
        for number in range(first, min(end, len(logs) - 1) + 1):
            log = logs[number]
            transfer.entries.append(
                mavlink.MAVLink_log_entry_message(
                    number, len(logs), last, log.time_utc_s & 0xFFFFFFFF, log.size & 0xFFFFFFFF
                )
            )

    def _data(self, link: Link, message: Message) -> None:
        if not self._exchange.is_for_us(message, or_everyone=True):
            return
        if self._logs is None:
            self._logs = self._find()
        name = link.profile.name
        if message.id >= len(self._logs) or message.ofs >= self._logs[message.id].size:
            self._transfers.pop(name, None)
            return
        log = self._logs[message.id]
        end = min(message.ofs + message.count, log.size)
        transfer = self._transfers.setdefault(name, _Transfer())
        transfer.log, transfer.number = log, message.id
        transfer.offset, transfer.end = message.ofs, end

    def _end(self, link: Link, message: Message) -> None:
        if self._exchange.is_for_us(message, or_everyone=True):
            self._transfers.pop(link.profile.name, None)

    def _erase(self, _link: Link, message: Message) -> None:
        """Remove all logs; one that is being written is restarted (`UlogRecorder`)."""
        if not self._exchange.is_for_us(message) or self._storage is None:
            return
        self._transfers.clear()
        for log in self._find():
            with suppress(OSError):
                self._storage.remove(log.path)
        for folder in self._folders():
            with suppress(OSError):  # other files may be in it
                self._storage.remove_folder(folder)
        self._logs = []

    def _folders(self) -> list[Path]:
        if self._storage is None:
            return []
        try:
            entries = self._storage.entries(LOG_FOLDER)
        except OSError:
            return []
        return [(*LOG_FOLDER, entry.name) for entry in entries if entry.is_folder]

    def _find(self) -> list[_Log]:
        logs: list[_Log] = []
        if self._storage is None:
            return logs
        for folder in self._folders():
            with suppress(OSError):
                logs += [
                    _Log((*folder, entry.name), entry.size, entry.modified_unix_s)
                    for entry in self._storage.entries(folder)
                    if not entry.is_folder and entry.name.endswith(LOG_SUFFIX)
                ]
        return logs[:_MAX_LOGS]
