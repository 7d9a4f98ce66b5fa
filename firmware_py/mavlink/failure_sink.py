"""Who can break parts of the vehicle on purpose."""

from __future__ import annotations

from typing import Protocol


class FailureSink(Protocol):
    """Who can break parts of the vehicle: its simulation."""

    def inject(self, unit: int, kind: int, instance: int) -> bool:
        """Break a part, or mend it.

        Args:
            unit: FAILURE_UNIT.
            kind: FAILURE_TYPE; 0 mends.
            instance: counts from 1; 0: all of that unit.

        Returns:
            False if it cannot be done; nothing has changed then.
        """
        ...
