"""Addresses of visitors, and limits of how many connections one address may have."""

from __future__ import annotations

from collections import Counter
from ipaddress import IPv6Address, ip_address, ip_network

from starlette.types import Scope


def visitor_key(address: str) -> str:
    """The key by which visitors are counted: an IPv4 address, or an IPv6 network of 64 bits.

    An IPv6 address is one of 2**64 of its owner; an IPv4 address written as IPv6 counts as IPv4.
    """
    try:
        parsed = ip_address(address)
    except ValueError:
        return address[:80]
    if not isinstance(parsed, IPv6Address):
        return str(parsed)
    if parsed.ipv4_mapped is not None:
        return str(parsed.ipv4_mapped)
    return str(ip_network(f"{parsed.packed.hex(':', 2)}/64", strict=False))


def client_address(scope: Scope) -> str:
    """The address a request or WebSocket comes from; "" if it is not known."""
    client = scope.get("client")
    return str(client[0]) if client else ""


def is_address_or_network(text: str) -> bool:
    """Whether a text is an IP address or a network such as 10.0.0.0/8."""
    try:
        ip_network(text)
    except ValueError:
        return False
    return True


class Places:
    """A limited number of places, of which one address may take at most `per_address`."""

    def __init__(self, total: int, per_address: int) -> None:
        self._total = total
        self._per_address = per_address
        self._taken: Counter[str] = Counter()
        self._count = 0

    def problem(self, address: str) -> str:
        """Why an address cannot have a place now, in one line; "" if it can."""
        if self._count >= self._total:
            return f"{self._total} are connected; no more can"
        if self._taken[visitor_key(address)] >= self._per_address:
            return f"{self._per_address} are connected from {address or 'one address'}; no more can"
        return ""

    def take(self, address: str) -> str:
        """Take a place. Returns "" or, if there is none, one line with the reason."""
        problem = self.problem(address)
        if not problem:
            self._taken[visitor_key(address)] += 1
            self._count += 1
        return problem

    def give_back(self, address: str) -> None:
        """Release a place that was taken for this address."""
        key = visitor_key(address)
        self._taken[key] -= 1
        self._count -= 1
        if self._taken[key] <= 0:
            del self._taken[key]

    def __len__(self) -> int:
        """The number of places taken."""
        return self._count
