"""How a flight ends when it does not finish, and who watches it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from offboard.safety.operator import Operator

AbortAction = Literal["hold", "land"]
HOLD_TIME_S = 30.0


@dataclass(frozen=True, slots=True)
class SafetyRules:
    """The rules of one flight.

    Attributes:
        abort: what the drone does when the flight is aborted: hold, or a soft landing where it is.
        operator: who gives the go and may stop it; None: nobody, as in a simulation.
        hold_s: vehicle time for which a drone with an operator holds before it lands.
    """

    abort: AbortAction = "hold"
    operator: Operator | None = None
    hold_s: float = HOLD_TIME_S


SIMULATED = SafetyRules()
"""Of a simulated drone: no operator, and it holds."""
