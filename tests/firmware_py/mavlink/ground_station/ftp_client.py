"""A MAVLink FTP client that behaves as MAVSDK's: half a second, ten tries, gaps of a burst are read later.

It runs in vehicle time over a `LossyPeer`, so a bad link costs no waiting.
"""

from struct import pack, unpack_from

from framerunner.wire.dialect import mavlink

NONE, TERMINATE, RESET, LIST, OPEN, READ, CREATE, WRITE = range(8)
REMOVE, MAKE_FOLDER, REMOVE_FOLDER, OPEN_WRITE, TRUNCATE, RENAME, CRC, BURST = range(8, 16)
ACK, NAK = 128, 129
FAIL_ERRNO, INVALID_SIZE, INVALID_SESSION, NO_SESSIONS, EOF = 2, 3, 4, 5, 6
UNKNOWN, EXISTS, PROTECTED, NOT_FOUND = 7, 8, 9, 10
_HEADER = "<HBBBBBBI"


class RefusedError(Exception):
    """A NAK; `code` is its first byte, `number` its second, if any."""

    def __init__(self, data):
        super().__init__(f"NAK {data[0]}")
        self.code, self.number = data[0], data[1] if len(data) > 1 else 0


class Reply:
    """An answer's payload, taken apart."""

    def __init__(self, payload):
        fields = unpack_from(_HEADER, bytes(payload))
        self.sequence, self.session, self.opcode, size, self.asked, self.complete, _, self.offset = fields
        self.data = bytes(payload)[12 : 12 + size]


def request(sequence, opcode, data=b"", *, session=0, offset=0, size=None, target=(1, 1)):
    """A FILE_TRANSFER_PROTOCOL message."""
    size = len(data) if size is None else size
    payload = pack(_HEADER, sequence & 0xFFFF, session, opcode, size, 0, 0, 0, offset) + data
    return mavlink.MAVLink_file_transfer_protocol_message(0, *target, payload.ljust(251, b"\0"))


class FtpClient:
    """Transfers over a `LossyPeer`; every method raises `RefusedError` or TimeoutError."""

    def __init__(self, lossy, session=0):
        self.lossy = lossy
        self.sequence = 0
        self.session = session
        self.retries = 0

    def _replies(self, seconds=0.5):
        for _ in range(round(seconds / 0.02)):
            for message in self.lossy.advance(0.02):
                if message.get_type() == "FILE_TRANSFER_PROTOCOL":
                    yield Reply(message.payload)

    def ask(self, opcode, data=b"", *, offset=0, size=None, tries=10):
        """One request until its answer comes."""
        sequence = self.sequence
        self.sequence = (self.sequence + 1) & 0xFFFF
        for attempt in range(tries):
            self.retries += attempt > 0
            self.lossy.send(request(sequence, opcode, data, session=self.session, offset=offset, size=size))
            for reply in self._replies():
                if reply.asked == opcode and reply.sequence == (sequence + 1) & 0xFFFF:
                    if reply.opcode == NAK:
                        raise RefusedError(reply.data)
                    return reply
        raise TimeoutError(f"no answer to opcode {opcode}")

    def list(self, path):
        """Names of folders with a slash, of files with their size."""
        names = []
        while True:
            try:
                page = self.ask(LIST, path.encode() + b"\0", offset=len(names)).data
            except RefusedError as refused:
                if refused.code == EOF:
                    return names
                raise
            names += [each.decode() for each in page.rstrip(b"\0").split(b"\0")]

    def write(self, path, content):
        """Upload."""
        self.ask(CREATE, path.encode() + b"\0")
        for offset in range(0, len(content), 239):
            self.ask(WRITE, content[offset : offset + 239], offset=offset)
        self.ask(TERMINATE)

    def read(self, path):
        """Download, packet by packet."""
        size = int.from_bytes(self.ask(OPEN, path.encode() + b"\0").data, "little")
        content = b""
        while len(content) < size:
            content += self.ask(READ, offset=len(content), size=239).data
        self.ask(TERMINATE)
        return content

    def burst(self, path):
        """Download in bursts; what got lost is read afterwards."""
        size = int.from_bytes(self.ask(OPEN, path.encode() + b"\0").data, "little")
        content, known = bytearray(size), set()
        offset = 0
        while offset < size:
            offset = self._one_burst(offset, content, known)
        for place in range(0, size, 239):
            if place not in known:
                data = self.ask(READ, offset=place, size=min(239, size - place)).data
                content[place : place + len(data)] = data
        self.ask(TERMINATE)
        return bytes(content)

    def _one_burst(self, offset, content, known):
        """Take what one request brings; where to go on."""
        sequence = self.sequence
        self.sequence += 1
        self.lossy.send(request(sequence, BURST, session=self.session, offset=offset, size=239))
        silent = 0
        while silent < 25:
            came = list(self._replies(0.02))
            silent = 0 if came else silent + 1
            for reply in came:
                if reply.asked != BURST:
                    continue
                if reply.opcode == NAK:
                    if reply.data[0] == EOF:
                        return max(offset, reply.offset)
                    raise RefusedError(reply.data)
                content[reply.offset : reply.offset + len(reply.data)] = reply.data
                known.add(reply.offset)
                self.sequence = max(self.sequence, reply.sequence)
                offset = max(offset, reply.offset + len(reply.data))
                if reply.complete:
                    return offset
        return offset

    def crc(self, path):
        """The vehicle's checksum of a file."""
        return int.from_bytes(self.ask(CRC, path.encode() + b"\0").data, "little")
