"""How framerunner's simulated drone says in AUTOPILOT_VERSION that it is one."""

from __future__ import annotations

_PREFIX = 0x66726D72  # "frmr"; the system id follows


def simulator_uid(system_id: int) -> int:
    """The `uid` of a simulated drone."""
    return _PREFIX << 32 | system_id


def is_simulator(uid: int, system_id: int) -> bool:
    """Whether a vehicle is framerunner's simulated drone; hardware has a processor's serial number."""
    return uid == simulator_uid(system_id)
