"""One number for a whole flight: equal only if every true state was equal to the last bit."""

from __future__ import annotations

import hashlib
from struct import Struct

from scenarios.truth import TrueState

_ROW = Struct("<12d")  # time in us, position, velocity, attitude, motors on
_CHUNK_BYTES = _ROW.size * 1000


class StateHash:
    """SHA-256 over true states, as little-endian float64s (whole microseconds are exact in them)."""

    __slots__ = ("_rows", "_sha256")

    def __init__(self) -> None:
        self._sha256 = hashlib.sha256()
        self._rows = bytearray()

    def add(self, truth: TrueState) -> None:
        """Take the next state."""
        rows = self._rows
        rows += _ROW.pack(
            truth.time_us,
            *truth.position_arena_m,
            *truth.velocity_arena_m_s,
            *truth.attitude_arena,
            truth.motors_on,
        )
        if len(rows) >= _CHUNK_BYTES:
            self._sha256.update(rows)
            rows.clear()

    def hexdigest(self) -> str:
        """The sum of all states so far."""
        self._sha256.update(self._rows)
        self._rows.clear()
        return self._sha256.hexdigest()
