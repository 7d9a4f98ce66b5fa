"""Images that mean harm."""

import struct


def progressive_of_many_scans(scans: int, width: int = 4096, height: int = 4096) -> bytes:
    """A small progressive JPEG; each of its scans visits every block of the image."""
    frame = struct.pack(">BHHB", 8, height, width, 3) + b"\x01\x11\x00\x02\x11\x00\x03\x11\x00"
    head = b"\xff\xd8" + _segment(0xDB, b"\0" + bytes([1] * 64)) + _segment(0xC2, frame)
    head += _segment(0xC4, b"\x00" + bytes([1] + [0] * 15) + b"\x00")
    first, refining = (
        _segment(0xDA, b"\x03\x01\x00\x02\x00\x03\x00\x00\x00" + b) for b in (b"\x01", b"\x10")
    )
    return head + first + b"\0" + (refining + bytes(83)) * (scans - 1) + b"\xff\xd9"


def _segment(marker: int, content: bytes) -> bytes:
    return b"\xff" + bytes([marker]) + struct.pack(">H", len(content) + 2) + content
