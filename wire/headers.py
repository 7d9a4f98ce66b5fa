"""Packet headers of MAVLink 1 and 2: their length, and where in noise one may begin.

The header fields are those of https://mavlink.io/en/guide/serialization.html.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from wire.dialect import mavlink

MARKER_V1 = int(mavlink.PROTOCOL_MARKER_V1)
MARKER_V2 = int(mavlink.PROTOCOL_MARKER_V2)
MARKERS = (MARKER_V1, MARKER_V2)
SIGNED = int(mavlink.MAVLINK_IFLAG_SIGNED)
SIGNATURE_BYTES = 13
CHECKSUM_BYTES = 2
HEADER_BYTES_V1 = int(mavlink.HEADER_LEN_V1)
HEADER_BYTES_V2 = int(mavlink.HEADER_LEN_V2)
CRC_EXTRA: dict[int, int] = {number: kind.crc_extra for number, kind in mavlink.mavlink_map.items()}

_ID_COUNT_V1 = 256
_PAYLOAD_BYTES_V1 = {n: kind.unpacker.size for n, kind in mavlink.mavlink_map.items() if n < _ID_COUNT_V1}
_KNOWN_IDS = np.zeros(1 << 16, dtype=np.bool_)  # all of the dialect's are below 2^16
_KNOWN_IDS[list(CRC_EXTRA)] = True


def _payloads_v1() -> npt.NDArray[np.bool_]:
    """By payload length and message id: whether a message of MAVLink 1 is as long at most."""
    most = np.full(_ID_COUNT_V1, -1)
    most[list(_PAYLOAD_BYTES_V1)] = list(_PAYLOAD_BYTES_V1.values())
    lengths = np.arange(256)
    return lengths[:, np.newaxis] <= most


_PAYLOADS_V1 = _payloads_v1()


def packet_length(data: bytes | bytearray, start: int) -> int | None:
    """Length in bytes of the packet whose header begins at `start`.

    Returns:
        None while the header is not complete; 0 if no packet can begin so.
    """
    available = len(data) - start
    if available < 3:
        return None
    if data[start] == MARKER_V1:
        known = available >= HEADER_BYTES_V1 and _PAYLOAD_BYTES_V1.get(data[start + 5])
        if known and data[start + 1] > known:
            return 0
        return HEADER_BYTES_V1 + data[start + 1] + CHECKSUM_BYTES
    flags = data[start + 2]
    if data[start] != MARKER_V2 or flags & ~SIGNED:
        return 0  # a flag that this version does not know: the packet must be dropped
    signature = SIGNATURE_BYTES if flags else 0
    return HEADER_BYTES_V2 + data[start + 1] + CHECKSUM_BYTES + signature


def possible_starts(window: bytes | bytearray) -> list[int]:
    """Where headers of known messages may begin, found without computing any checksum.

    Args:
        window: only starts with `HEADER_BYTES_V2` bytes of it after them are found.
    """
    count = len(window) - HEADER_BYTES_V2 + 1
    if count <= 0:
        return []
    data = np.frombuffer(bytes(window), dtype=np.uint8)
    first = data[:count]
    starts_v1 = np.flatnonzero(first == MARKER_V1)
    if starts_v1.size:
        starts_v1 = starts_v1[_PAYLOADS_V1[data[starts_v1 + 1], data[starts_v1 + 5]]]
    starts_v2 = np.flatnonzero((first == MARKER_V2) & (data[2 : count + 2] <= SIGNED))
    if starts_v2.size:
        low = data[starts_v2 + 7] | data[starts_v2 + 8].astype(np.uint16) << 8
        starts_v2 = starts_v2[(data[starts_v2 + 9] == 0) & _KNOWN_IDS[low]]
    return sorted([*starts_v1.tolist(), *starts_v2.tolist()])
