"""How a drone that may be a real one is flown."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from offboard.safety.rules import HOLD_TIME_S, AbortAction

DRY_RUN_S = 15.0
"""Vehicle time for which a dry run lets the mission run."""


@dataclass(frozen=True, slots=True)
class HardwareSettings:
    """The procedure of one flight.

    Attributes:
        needs_go: an operator gives the go before arming.
        abort: what the drone does when the flight is aborted.
        hold_s: vehicle time for which it holds before it lands, if it holds.
        dry_run: all but arming.
        set_parameters: failsafe parameters that fail their check are set; their old values are kept.
        accepted: names of checks that may fail.
        operator: who flies, for the flight card; empty: the user of this computer.
        capped: caps on speed or height were asked for.
        operator_socket: at which the monitor with the operator's page listens; None: not asked for.
    """

    needs_go: bool = True
    abort: AbortAction = "land"
    hold_s: float = HOLD_TIME_S
    dry_run: bool = False
    set_parameters: bool = False
    accepted: tuple[str, ...] = ()
    operator: str = ""
    capped: bool = False
    operator_socket: Path | None = None

    @property
    def asks_nothing(self) -> bool:
        """Nothing of the procedure was asked for; a simulated drone that is recognised needs none."""
        return replace(self, capped=False) == HardwareSettings()
