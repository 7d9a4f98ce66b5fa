"""One number for a whole flight: equal only if every true state was equal to the last bit."""

from __future__ import annotations

import hashlib
from struct import Struct

from scenarios.truth import TrueState

_ROW = Struct("<12d")  # time in us, position, velocity, attitude, motors on
_ROW_BYTES = _ROW.size
_CHUNK_BYTES = _ROW_BYTES * 1000


class StateHash:
    """SHA-256 over true states, as little-endian float64s (whole microseconds are exact in them)."""

    __slots__ = ("_filled", "_rows", "_sha256")

    def __init__(self) -> None:
        self._sha256 = hashlib.sha256()
        self._rows = bytearray(_CHUNK_BYTES)
        self._filled = 0

    def add(self, truth: TrueState) -> None:
        """Take the next state."""
        _ROW.pack_into(
            self._rows,
            self._filled,
            truth.time_us,
            *truth.position_arena_m,
            *truth.velocity_arena_m_s,
            *truth.attitude_arena,
            truth.motors_on,
        )
        self._filled += _ROW_BYTES
        if self._filled == _CHUNK_BYTES:
            self._sha256.update(self._rows)
            self._filled = 0

    def hexdigest(self) -> str:
        """The sum of all states so far."""
        so_far = self._sha256.copy()
        so_far.update(memoryview(self._rows)[: self._filled])
        return so_far.hexdigest()
