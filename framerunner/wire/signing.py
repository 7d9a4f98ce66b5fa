"""MAVLink 2 signing: packets without the key's signature are refused, and so are replayed ones.

https://mavlink.io/en/guide/message_signing.html: the signature is the first 48 bits of the SHA-256 over key,
packet, link id and a timestamp, which must increase from packet to packet of a (system, component, link id).
PX4 v1.17 cannot sign; the rules for unsigned packets are those of later versions: with a key they are
refused, except on links that cannot be reached from outside (there USB, here loopback), so that companion
apps that cannot sign, such as MAVSDK's, work beside a signed radio.
"""

from __future__ import annotations

from hashlib import sha256

from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.framing import SIGNATURE_BYTES, message_id_of, source_of

KEY_BYTES = 32
_HASH_BYTES = 6
_EPOCH_UNIX_US = 1_420_070_400_000_000  # timestamps count 10 us from 2015-01-01
_MINUTE = 6_000_000  # of timestamps; a new stream may be that late
_MAX_TIMESTAMP = (1 << 48) - 1
_MAX_STREAMS = 255
_ALWAYS = (mavlink.MAVLINK_MSG_ID_RADIO_STATUS,)  # radios cannot sign


class SigningKey:
    """A secret of 32 bytes that is hidden when the object is printed.

    Raises:
        ValueError: it does not have 32 bytes, or they are all zero, which means "no signing".
    """

    def __init__(self, secret: bytes) -> None:
        if len(secret) != KEY_BYTES or not any(secret):
            raise ValueError("a signing key has 32 bytes, not all zero")
        self.secret = secret

    def __repr__(self) -> str:
        return "SigningKey(hidden)"

    @classmethod
    def from_text(cls, text: str) -> SigningKey:
        """The key of 64 hexadecimal digits, or of a passphrase, which is its SHA-256.

        Raises:
            ValueError: the text is empty or no key.
        """
        text = text.removeprefix("\ufeff").strip()
        if not text:
            raise ValueError("it is empty; it must hold 64 hexadecimal digits or a passphrase")
        if len(text) == 2 * KEY_BYTES:
            try:
                return cls(bytes.fromhex(text))
            except ValueError as error:
                if "32 bytes" in str(error):
                    raise
        return cls(sha256(text.encode()).digest())


class Signing:
    """The signing of one vehicle: its key, its clock and the latest timestamps of its peers.

    Without a key it is not active: it signs nothing and accepts all packets, until SETUP_SIGNING contains
    one.
    """

    def __init__(self, key: SigningKey | None, boot_unix_us: int) -> None:
        self._boot_us = boot_unix_us - _EPOCH_UNIX_US
        self._streams: dict[tuple[int, int, int], int] = {}  # timestamp by system, component and link id
        self._timestamp = 0
        self._key = b""
        self.active = False
        self.set_key(key)
        self.advance(0)

    def set_key(self, key: SigningKey | None, timestamp: int = 0) -> None:
        """Change the key, None ends signing; the next timestamp is above `timestamp`."""
        self._key = b"" if key is None else key.secret
        self._timestamp = max(self._timestamp, timestamp)
        self._streams.clear()
        self.active = key is not None

    def advance(self, time_us: int) -> None:
        """Set vehicle time; the timestamp never decreases."""
        self._timestamp = max(self._timestamp, (self._boot_us + time_us) // 10)

    def block(self, packet: bytes, link_id: int) -> bytes:
        """The 13 bytes to append to a packet with the flag for "signed", sent on a link from 0 to 255."""
        self._timestamp = min(self._timestamp + 1, _MAX_TIMESTAMP)
        stamp = bytes((link_id,)) + self._timestamp.to_bytes(6, "little")
        return stamp + sha256(self._key + packet + stamp).digest()[:_HASH_BYTES]

    def accepts(self, packet: bytes | bytearray, *, trusted: bool) -> bool:
        """Whether to accept a received packet; `trusted`: its link cannot be reached from outside."""
        if not self.active or message_id_of(packet) in _ALWAYS:
            return True
        if packet[0] != mavlink.PROTOCOL_MARKER_V2 or not packet[2] & mavlink.MAVLINK_IFLAG_SIGNED:
            return trusted
        return self._is_valid(packet)

    def _is_valid(self, packet: bytes | bytearray) -> bool:
        signed = len(packet) - _HASH_BYTES
        if sha256(self._key + packet[:signed]).digest()[:_HASH_BYTES] != packet[signed:]:
            return False
        stamp = len(packet) - SIGNATURE_BYTES
        stream = (*source_of(packet), packet[stamp])
        timestamp = int.from_bytes(packet[stamp + 1 : signed], "little")
        last = self._streams.get(stream)
        if last is None and (timestamp + _MINUTE < self._timestamp or len(self._streams) >= _MAX_STREAMS):
            return False
        if last is not None and timestamp <= last:
            return False
        self._streams[stream] = timestamp
        self._timestamp = max(self._timestamp, timestamp)
        return True

    def set_up(self, message: Message) -> bool:
        """Take the key of SETUP_SIGNING, zeros end signing; False if its timestamp is too high."""
        secret = bytes(message.secret_key)
        if message.initial_timestamp > _MAX_TIMESTAMP // 2:
            return False
        self.set_key(SigningKey(secret) if any(secret) else None, message.initial_timestamp)
        return True
