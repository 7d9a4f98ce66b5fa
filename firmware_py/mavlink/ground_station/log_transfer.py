"""Log download: LOG_REQUEST_LIST, LOG_REQUEST_DATA, LOG_REQUEST_END and LOG_ERASE, as PX4 answers them.

Logs are the files in the folders of `log/`, numbered from 0 in the order of their names. The numbers hold
until the list is asked for again. Different from PX4: without any log one LOG_ENTRY says so (PX4 is silent,
and clients wait for their time-out), data can be asked for before the list, a list ends where it was asked
to, and what is meant for another vehicle is left to it.
"""

from __future__ import annotations

from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field

from firmware_py.mavlink.service import Service
from firmware_py.storage import Path, Storage
from wire.dialect import Message, mavlink
from wire.exchange import Exchange
from wire.link import Link

LOG_FOLDER: Path = ("log",)
_CHUNK = 90
_PACKETS = 8  # a link and update: 180 kB/s at 250 updates a second
_LAST = 0xFFFF
_MAX_LOGS = 1000


@dataclass(frozen=True, slots=True)
class _Log:
    path: Path
    size: int
    time_utc_s: int


@dataclass(slots=True)
class _Transfer:
    """What one link is owed.

    Attributes:
        asked: first and last number of a list that was asked for.
        entries: LOG_ENTRY messages to be sent.
        log: whose data is sent.
        number: of that log.
        offset: of the next data.
        end: where to stop.
    """

    asked: tuple[int, int] | None = None
    entries: deque[Message] = field(default_factory=deque)
    log: _Log | None = None
    number: int = 0
    offset: int = 0
    end: int = 0


class LogTransferService(Service):
    """Lists and sends the logs.

    Args:
        storage: where the logs are; None: there are none.
    """

    def __init__(self, exchange: Exchange, storage: Storage | None) -> None:
        self._exchange = exchange
        self._storage = storage
        self._logs: list[_Log] | None = None
        self._transfers: dict[str, _Transfer] = {}  # by link; what nothing is owed on is left out
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
        """Send a few packets; whether more are owed."""
        if transfer.asked is not None:
            self._make_list(transfer, *transfer.asked)
            transfer.asked = None
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
        transfer.asked, transfer.log = (message.start, message.end), None

    def _make_list(self, transfer: _Transfer, first: int, end: int) -> None:
        """At the next update, not at once: a flight that has just ended is then written down."""
        self._logs = logs = self._find()
        transfer.entries.clear()
        if not logs:
            transfer.entries.append(mavlink.MAVLink_log_entry_message(0, 0, 0, 0, 0))
        last = len(logs) if end == _LAST else end  # PX4's way to fill last_log_num
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
        """Remove all logs; one that is being written is started again (`UlogRecorder`)."""
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
                    if not entry.is_folder
                ]
        return logs[:_MAX_LOGS]
