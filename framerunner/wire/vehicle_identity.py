"""Which vehicle it is, by its AUTOPILOT_VERSION, and whether it is framerunner's simulated drone."""

from __future__ import annotations

from framerunner.wire.dialect import Message

_PREFIX = 0x66726D72  # "frmr"; the system id follows


def simulator_uid(system_id: int) -> int:
    """The `uid` of a simulated drone."""
    return _PREFIX << 32 | system_id


def is_simulator(uid: int, system_id: int) -> bool:
    """Whether a vehicle is framerunner's simulated drone; hardware has a processor's serial number."""
    return uid == simulator_uid(system_id)


def vehicle_uid(version: Message) -> str:
    """The unique number of a vehicle's hardware, hexadecimal; empty if it gives none.

    AUTOPILOT_VERSION has two: `uid2`, 18 bytes, replaces the older `uid` where it is not zero.
    """
    longer = bytes(version.uid2)
    if any(longer):
        return longer.hex()
    return f"{version.uid:016x}" if version.uid else ""
