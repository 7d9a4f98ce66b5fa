"""Where a pilot holds the sticks, and the MANUAL_CONTROL that says so."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from wire.dialect import Message, mavlink

RATE_HZ = 25.0
_FULL = 1000
_MIDDLE = 500  # MANUAL_CONTROL's thrust goes from 0 to 1000


@dataclass(frozen=True, slots=True)
class Sticks:
    """Deflections, each -1 to 1; what is beyond or no number is brought within when it is sent.

    Attributes:
        forward: right stick, away from the pilot is positive.
        right: right stick, to the right is positive.
        up: left stick, away from the pilot is positive.
        yaw: left stick, to the right (clockwise from above) is positive.
    """

    forward: float
    right: float
    up: float
    yaw: float


def manual_control(system_id: int, sticks: Sticks) -> Message:
    """Write the message.

    Args:
        system_id: of the vehicle that is steered.
        sticks: where they are; a value that is not a number counts as centred.
    """
    return mavlink.MAVLink_manual_control_message(
        system_id,
        round(_FULL * _within(sticks.forward)),
        round(_FULL * _within(sticks.right)),
        round(_MIDDLE + _MIDDLE * _within(sticks.up)),
        round(_FULL * _within(sticks.yaw)),
        0,
    )


def _within(value: float) -> float:
    return min(1.0, max(-1.0, value)) if isfinite(value) else 0.0
