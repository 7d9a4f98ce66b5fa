"""Values of parameters for a genuine autopilot."""

from __future__ import annotations

Value = int | float


def text_of(value: Value) -> str:
    """A value as PX4 and ArduPilot read it; a whole number has no decimal point."""
    return str(value) if isinstance(value, int) else f"{value:.7g}"
