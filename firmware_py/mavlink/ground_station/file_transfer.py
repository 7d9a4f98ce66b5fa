"""MAVLink FTP: lists, reads and writes a vehicle's files.

As PX4: the opcodes and errors; system 0 is answered; a repeated request that changed something gets the same
answer and changes nothing again; a burst pauses after 35 kB until the client requests more; a session that is
unused for ten seconds is closed. `@PARAM/param.pck`, which MAVProxy requests first, is a file not found.

Different: sessions belong to clients, not to links, and a client may have four (PX4: one a link); the
firmware's files (`etc`) are read-only; written files have a quota.
"""

from __future__ import annotations

import errno
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from struct import pack
from zlib import crc32

from firmware_py.mavlink.ground_station.file_sessions import (
    DATA_BYTES,
    Burst,
    Client,
    Clients,
    FileAnswer,
    FileRequest,
    FileSession,
    RefusalError,
    nak_data,
    parse,
)
from firmware_py.mavlink.service import Service
from firmware_py.storage import Path, Storage, StorageEntry, parse_path, refuse, sound_name
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

_BURST_PACKETS = 8  # a link and update: some 480 kB/s at 250 updates a second
_BURST_BYTES = 35_000  # as PX4
_CRC_BYTES = 1 << 20  # an update
_MAX_CHECKSUMS = 8  # at a time
_CHANGING = frozenset(
    {
        mavlink.MAV_FTP_OPCODE_TERMINATESESSION,
        mavlink.MAV_FTP_OPCODE_OPENFILERO,
        mavlink.MAV_FTP_OPCODE_CREATEFILE,
        mavlink.MAV_FTP_OPCODE_OPENFILEWO,
        mavlink.MAV_FTP_OPCODE_WRITEFILE,
        mavlink.MAV_FTP_OPCODE_REMOVEFILE,
        mavlink.MAV_FTP_OPCODE_CREATEDIRECTORY,
        mavlink.MAV_FTP_OPCODE_REMOVEDIRECTORY,
        mavlink.MAV_FTP_OPCODE_RENAME,
    }
)


class FileTree:
    """Storage and the firmware's own files as one tree. Its methods raise OSError as `Storage` does.

    Args:
        storage: files that clients may change; None: there are none.
        firmware_files: read-only files, content by path, such as `etc/extras/parameters.json.xz`. Nothing
            else can be in their top folders. Content is looked up only when a client reads it.
    """

    def __init__(self, storage: Storage | None, firmware_files: Mapping[str, bytes]) -> None:
        self._storage = storage
        self._files = firmware_files
        self._firmware = {parse_path(name.encode()): name for name in firmware_files}
        self._folders = {path[:depth] for path in self._firmware for depth in range(1, len(path))}
        self._tops = {path[0] for path in self._firmware}

    def entry(self, path: Path) -> StorageEntry:
        """The file or folder at a path."""
        if not self._is_firmware(path):
            return self._need_storage(path).entry(path)
        if path in self._firmware:
            return StorageEntry(path[-1], len(self._files[self._firmware[path]]))
        if path in self._folders:
            return StorageEntry(path[-1], 0, True)
        raise refuse(errno.ENOENT, path)

    def entries(self, path: Path) -> list[StorageEntry]:
        """The content of a folder, sorted by name."""
        if self._is_firmware(path):
            if path in self._firmware:
                raise refuse(errno.ENOTDIR, path)
            self.entry(path)
            return self._firmware_entries(path)
        stored = [] if self._storage is None and not path else self._need_storage(path).entries(path)
        if path:
            return stored
        both = [each for each in stored if each.name not in self._tops] + self._firmware_entries(())
        return sorted(both, key=lambda each: each.name)

    def read(self, path: Path, offset: int, count: int) -> bytes:
        """At most `count` bytes of a file."""
        if not self._is_firmware(path):
            return self._need_storage(path).read(path, offset, count)
        if path not in self._firmware:
            raise refuse(errno.EISDIR if path in self._folders else errno.ENOENT, path)
        return self._files[self._firmware[path]][offset : offset + count]

    def writable(self, path: Path) -> Storage:
        """The storage, for a path that a client may change.

        Raises:
            OSError: EACCES, the path is the firmware's or the root, or there is no storage.
        """
        if not path or self._is_firmware(path) or self._storage is None:
            raise refuse(errno.EACCES, path)
        return self._storage

    def listing(self, path: Path, first: int) -> bytes:
        """A page of a folder's listing: zero-terminated `Dname`, `Fname<tab>size` or `S` for each entry.

        Args:
            path: of the folder.
            first: index of the page's first entry.

        Returns:
            As many as fit into one answer; empty: there are no more.
        """
        page = bytearray()
        for entry in self.entries(path)[first:]:
            line = _line(entry)
            if len(page) + len(line) > DATA_BYTES:
                break
            page += line
        return bytes(page)

    def _is_firmware(self, path: Path) -> bool:
        return bool(path) and path[0] in self._tops

    def _need_storage(self, path: Path) -> Storage:
        if self._storage is None:
            raise refuse(errno.ENOENT, path)
        return self._storage

    def _firmware_entries(self, path: Path) -> list[StorageEntry]:
        depth = len(path) + 1
        inside = [each for each in (*self._firmware, *self._folders) if len(each) == depth]
        return [self.entry(each) for each in sorted(inside) if each[:-1] == path]


def _line(entry: StorageEntry) -> bytes:
    if not sound_name(entry.name):
        return b"S\0"
    if entry.is_folder:
        return b"D" + entry.name.encode() + b"\0"
    return f"F{entry.name}\t{entry.size}\0".encode()


@dataclass(slots=True)
class _Checksum:
    """A CRC-32 being computed; it is answered when the whole file is read."""

    client: Client
    request: FileRequest
    path: Path
    size: int
    offset: int = 0
    crc: int = 0xFFFFFFFF  # zlib's inverted zero: PX4's sum starts at 0 and is not inverted


class FileOperations:
    """Executes requests that are answered at once; RefusalError and OSError of its methods become NAKs."""

    def __init__(self, tree: FileTree, exchange: Exchange) -> None:
        self._tree = tree
        self._exchange = exchange
        self.table: dict[int, Callable[[Client, FileRequest], FileAnswer]] = {
            mavlink.MAV_FTP_OPCODE_NONE: self._nothing,
            mavlink.MAV_FTP_OPCODE_TERMINATESESSION: self._terminate,
            mavlink.MAV_FTP_OPCODE_RESETSESSION: self._reset,
            mavlink.MAV_FTP_OPCODE_LISTDIRECTORY: self._list,
            mavlink.MAV_FTP_OPCODE_OPENFILERO: self._open,
            mavlink.MAV_FTP_OPCODE_READFILE: self._read,
            mavlink.MAV_FTP_OPCODE_CREATEFILE: self._open,
            mavlink.MAV_FTP_OPCODE_WRITEFILE: self._write,
            mavlink.MAV_FTP_OPCODE_REMOVEFILE: self._change,
            mavlink.MAV_FTP_OPCODE_CREATEDIRECTORY: self._change,
            mavlink.MAV_FTP_OPCODE_REMOVEDIRECTORY: self._change,
            mavlink.MAV_FTP_OPCODE_OPENFILEWO: self._open,
            mavlink.MAV_FTP_OPCODE_TRUNCATEFILE: self._change,
            mavlink.MAV_FTP_OPCODE_RENAME: self._rename,
        }

    def reading(self, client: Client, request: FileRequest) -> FileSession:
        """The session that a request reads from."""
        session = client.session(request.session, self._exchange.time_us)
        if session.writable:
            raise refuse(errno.EBADF, session.path)
        return session

    def _nothing(self, _client: Client, request: FileRequest) -> FileAnswer:
        return FileAnswer(request.data, session=request.session, offset=request.offset)

    def _terminate(self, client: Client, request: FileRequest) -> FileAnswer:
        client.session(request.session, self._exchange.time_us)
        client.close([request.session], request.raw, self._exchange.time_us)
        return FileAnswer(session=request.session)

    def _reset(self, client: Client, request: FileRequest) -> FileAnswer:
        client.close(list(client.sessions), request.raw, self._exchange.time_us)
        return FileAnswer(session=request.session)

    def _list(self, _client: Client, request: FileRequest) -> FileAnswer:
        page = self._tree.listing(parse_path(request.path), request.offset)
        if not page:
            raise RefusalError(mavlink.MAV_FTP_ERR_EOF)
        return FileAnswer(page, session=request.session, offset=request.offset)

    def _open(self, client: Client, request: FileRequest) -> FileAnswer:
        number, time_us = request.session, self._exchange.time_us
        twin = client.twin(number, request.raw, time_us)
        if twin is not None:
            return FileAnswer(pack("<I", twin.size), session=number)
        client.free(number, time_us)
        path, writable = parse_path(request.path), request.opcode != mavlink.MAV_FTP_OPCODE_OPENFILERO
        size = self._prepare(path, request.opcode)
        client.sessions[number] = FileSession(path, size, writable, request.raw, time_us, time_us)
        return FileAnswer(pack("<I", size & 0xFFFFFFFF), session=number)

    def _prepare(self, path: Path, opcode: int) -> int:
        """Check or create a file to be opened; its size before that, as PX4 reports it."""
        try:
            entry = self._tree.entry(path)
            if entry.is_folder:
                raise refuse(errno.EISDIR, path)
            size = entry.size
        except FileNotFoundError:
            if opcode == mavlink.MAV_FTP_OPCODE_OPENFILERO:
                raise
            self._tree.writable(path).create(path)
            return 0
        if opcode != mavlink.MAV_FTP_OPCODE_OPENFILERO:
            storage = self._tree.writable(path)
            if opcode == mavlink.MAV_FTP_OPCODE_CREATEFILE:
                storage.truncate(path, 0)
        return size

    def _read(self, client: Client, request: FileRequest) -> FileAnswer:
        session = self.reading(client, request)
        if request.offset >= session.size:
            raise RefusalError(mavlink.MAV_FTP_ERR_EOF)
        data = self._tree.read(session.path, request.offset, request.size)
        return FileAnswer(data, session=request.session, offset=request.offset)

    def _write(self, client: Client, request: FileRequest) -> FileAnswer:
        session = client.session(request.session, self._exchange.time_us)
        if not session.writable:
            raise refuse(errno.EBADF, session.path)
        self._tree.writable(session.path).write(session.path, request.offset, request.data)
        return FileAnswer(pack("<I", len(request.data)), session=request.session, offset=request.offset)

    def _change(self, _client: Client, request: FileRequest) -> FileAnswer:
        path, offset = parse_path(request.path), 0
        storage = self._tree.writable(path)
        match request.opcode:
            case mavlink.MAV_FTP_OPCODE_REMOVEFILE:
                storage.remove(path)
            case mavlink.MAV_FTP_OPCODE_CREATEDIRECTORY:
                storage.make_folder(path)
            case mavlink.MAV_FTP_OPCODE_REMOVEDIRECTORY:
                storage.remove_folder(path)
            case mavlink.MAV_FTP_OPCODE_TRUNCATEFILE:
                offset = request.offset
                storage.truncate(path, offset)
        return FileAnswer(session=request.session, offset=offset)

    def _rename(self, _client: Client, request: FileRequest) -> FileAnswer:
        names = request.strings
        if len(names) < 2:
            raise refuse(errno.EINVAL, ())
        old, new = parse_path(names[0]), parse_path(names[1])
        self._tree.writable(old)
        self._tree.writable(new).rename(old, new)
        return FileAnswer(session=request.session)


class FileTransferService(Service):
    """Serves the files of a `FileTree`."""

    def __init__(
        self, exchange: Exchange, storage: Storage | None, firmware_files: Mapping[str, bytes]
    ) -> None:
        self._exchange = exchange
        self._tree = FileTree(storage, firmware_files)
        self._operations = FileOperations(self._tree, exchange)
        self._work: dict[int, Callable[[Client, FileRequest], FileAnswer | None]] = {
            **self._operations.table,
            mavlink.MAV_FTP_OPCODE_CALCFILECRC: self._checksum,
            mavlink.MAV_FTP_OPCODE_BURSTREADFILE: self._burst,
        }
        self._clients = Clients()
        self._checksums: list[_Checksum] = []
        self._idle_due_us = 0
        self.handlers = {mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL: self._receive}

    def update(self) -> None:
        """Continue bursts and checksums, and close what is unused."""
        if not self._clients:
            return
        if self._checksums:
            self._continue_checksum(self._checksums[0])
        room = dict.fromkeys(self._exchange.links, _BURST_PACKETS)
        for client, number, session in self._clients.bursting():
            self._send_burst(client, number, session, room)
        if self._exchange.time_us >= self._idle_due_us:
            self._idle_due_us = self._exchange.time_us + 1_000_000
            self._clients.close_idle(self._exchange.time_us)

    def _receive(self, link: Link, message: Message) -> None:
        if not self._exchange.is_for_us(message, or_everyone=True):
            return
        request = parse(bytes(message.payload))
        if request.opcode in (mavlink.MAV_FTP_OPCODE_ACK, mavlink.MAV_FTP_OPCODE_NAK):
            return  # an answer, not a request
        key = (link.profile.name, message.get_srcSystem(), message.get_srcComponent())
        client = self._clients.client(key, self._exchange.time_us)
        if request.raw == client.last_request:
            self._send(client, client.last_reply)
            return
        answer = self._answer(client, request)
        if answer is not None:
            self._reply(client, request, answer)

    def _answer(self, client: Client, request: FileRequest) -> FileAnswer | None:
        """Execute a request; None: it is answered later."""
        try:
            if request.size > DATA_BYTES:
                raise RefusalError(mavlink.MAV_FTP_ERR_INVALIDDATASIZE)
            work = self._work.get(request.opcode)
            if work is None:
                raise RefusalError(mavlink.MAV_FTP_ERR_UNKNOWNCOMMAND)
            return work(client, request)
        except (RefusalError, OSError) as error:
            return FileAnswer(nak_data(error), ack=False, session=request.session, offset=request.offset)

    def _reply(self, client: Client, request: FileRequest, answer: FileAnswer) -> None:
        payload = answer.payload(request.sequence + 1, request.opcode)
        no_session = bytes((mavlink.MAV_FTP_ERR_NOSESSIONSAVAILABLE,))
        keep = request.opcode in _CHANGING and answer.data != no_session
        client.last_request, client.last_reply = (request.raw, payload) if keep else (b"", b"")
        self._send(client, payload)

    def _send(self, client: Client, payload: bytes) -> None:
        name, system, component = client.key
        link = self._exchange.links.get(name)
        if link is not None:
            message = mavlink.MAVLink_file_transfer_protocol_message(0, system, component, payload)
            self._exchange.send(link, message)

    def _checksum(self, client: Client, request: FileRequest) -> FileAnswer | None:
        path = parse_path(request.path)
        entry = self._tree.entry(path)
        if entry.is_folder:
            raise refuse(errno.EISDIR, path)
        if any(each.client is client for each in self._checksums):
            return None  # a repeated request while it is computed
        if len(self._checksums) >= _MAX_CHECKSUMS:
            raise RefusalError(mavlink.MAV_FTP_ERR_NOSESSIONSAVAILABLE)
        self._checksums.append(_Checksum(client, request, path, entry.size))
        self._continue_checksum(self._checksums[-1])
        return None

    def _continue_checksum(self, checksum: _Checksum) -> None:
        """Read the next part of the file; answer at its end."""
        count = min(_CRC_BYTES, checksum.size - checksum.offset)
        try:
            data = self._tree.read(checksum.path, checksum.offset, count)
        except OSError as error:
            answer = FileAnswer(nak_data(error), ack=False, session=checksum.request.session)
        else:
            checksum.crc = crc32(data, checksum.crc)
            checksum.offset += len(data)
            if data and checksum.offset < checksum.size:
                return
            answer = FileAnswer(pack("<I", checksum.crc ^ 0xFFFFFFFF), session=checksum.request.session)
        self._checksums.remove(checksum)
        self._reply(checksum.client, checksum.request, answer)

    def _burst(self, client: Client, request: FileRequest) -> None:
        session = self._operations.reading(client, request)
        if session.burst is None or session.burst.request != request.raw:  # else it was received twice
            session.burst = Burst(request.raw, request.sequence + 1, request.offset)

    def _send_burst(self, client: Client, number: int, session: FileSession, room: dict[str, int]) -> None:
        """Send the next packets of a burst, as many as its link has room for."""
        link = self._exchange.links.get(client.key[0])
        if link is None:
            session.burst = None
            return
        while session.burst is not None and room[link.profile.name] > 0 and not link.congested:
            room[link.profile.name] -= 1
            self._send(client, self._burst_packet(session.burst, number, session))
            session.used_us = client.used_us = self._exchange.time_us

    def _burst_packet(self, burst: Burst, number: int, session: FileSession) -> bytes:
        """The next packet; the burst ends after the end of the file, an error, or 35 kB."""
        sequence, offset = burst.sequence, burst.offset
        try:
            if offset >= session.size:
                raise RefusalError(mavlink.MAV_FTP_ERR_EOF)
            data = self._tree.read(session.path, offset, DATA_BYTES)
            if not data:
                raise RefusalError(mavlink.MAV_FTP_ERR_EOF)  # the file has become shorter
        except (RefusalError, OSError) as error:
            session.burst = None
            answer = FileAnswer(nak_data(error), ack=False, session=number, offset=offset)
            return answer.payload(sequence, mavlink.MAV_FTP_OPCODE_BURSTREADFILE)
        burst.sequence += 1
        burst.offset += len(data)
        burst.sent_bytes += len(data)
        complete = burst.sent_bytes > _BURST_BYTES
        if complete:
            session.burst = None
        answer = FileAnswer(data, session=number, offset=offset, burst_complete=complete)
        return answer.payload(sequence, mavlink.MAV_FTP_OPCODE_BURSTREADFILE)
