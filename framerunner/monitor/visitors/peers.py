"""Whose program is at the other end of a connection within this machine, as far as the system tells it.

That a connection comes from this machine says nothing: any account of it can connect. Linux lists in
/proc/net/tcp who has made a socket; other systems do not tell, and then nobody is taken for the user.
"""

from __future__ import annotations

import os
import struct
from ipaddress import IPv4Address, IPv6Address, ip_address
from pathlib import Path

from starlette.requests import HTTPConnection

from framerunner.files.text_file import TextError, read_text

_TABLES = Path("/proc/net")
_MOST_BYTES = 1 << 25  # of a table, which has a line for each connection of this machine
_ESTABLISHED = "01"
_KNOWN = "framerunner.own"  # in a connection's scope
Place = tuple[str, int]


def is_own_connection(connection: HTTPConnection) -> bool:
    """Whether a program of the user who runs this one sent a request; False if that is not known."""
    scope = connection.scope
    if _KNOWN not in scope:
        client, server = scope.get("client"), scope.get("server")
        is_known = client is not None and server is not None and server[1] is not None
        scope[_KNOWN] = is_known and peer_uid(tuple(client or ()), tuple(server or ())) == os.getuid()
    return bool(scope[_KNOWN])


def peer_uid(client: Place, server: Place, tables: Path = _TABLES) -> int | None:
    """The user who has made the client's end of a connection within this machine; None if that is not known.

    Args:
        client: address and port of its end.
        server: likewise of the other one.
        tables: folder with the system's tables `tcp` and `tcp6`.
    """
    try:
        ends = ip_address(client[0]), ip_address(server[0])
    except ValueError:
        return None
    for name, write in (("tcp", _as_ipv4), ("tcp6", _as_ipv6)):
        written = [write(end) for end in ends]
        if "" in written:
            continue
        wanted = [
            f"{address}:{port:04X}" for address, (_, port) in zip(written, (client, server), strict=True)
        ]
        try:
            lines = read_text(tables / name, _MOST_BYTES).splitlines()[1:]
        except TextError:
            continue
        for line in lines:
            fields = line.split()
            # A socket that its program has closed is listed as root's, with inode 0.
            if fields[1:3] == wanted and fields[3] == _ESTABLISHED and fields[9] != "0":
                return int(fields[7])
    return None


def _as_ipv4(address: IPv4Address | IPv6Address) -> str:
    """As the table `tcp` writes an address; "" if that has none of its kind."""
    if isinstance(address, IPv6Address):
        if address.ipv4_mapped is None:
            return ""
        address = address.ipv4_mapped
    return _words(address.packed)


def _as_ipv6(address: IPv4Address | IPv6Address) -> str:
    """Likewise the table `tcp6`, which has IPv4 addresses of programs that listen for both."""
    mapped = b"\0" * 10 + b"\xff\xff"
    return _words(mapped + address.packed if isinstance(address, IPv4Address) else address.packed)


def _words(packed: bytes) -> str:
    """Words of 32 bits as this machine reads them."""
    return "".join(f"{word:08X}" for word in struct.unpack(f"={len(packed) // 4}I", packed))
