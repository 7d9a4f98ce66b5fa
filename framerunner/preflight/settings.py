"""How a drone that may be a real one is flown."""

from __future__ import annotations

from dataclasses import dataclass

from offboard.safety.rules import AbortAction

DRY_RUN_S = 15.0
"""Vehicle time for which a dry run lets the mission run."""


@dataclass(frozen=True, slots=True)
class HardwareSettings:
    """The procedure of one flight.

    Attributes:
        needs_go: an operator gives the go before arming.
        abort: what the drone does when the flight is aborted.
        dry_run: all but arming.
        set_parameters: failsafe parameters that fail their check are set; their old values are kept.
        accepted: names of checks that may fail.
        operator: who flies, for the flight card; empty: the user of this computer.
    """

    needs_go: bool = True
    abort: AbortAction = "land"
    dry_run: bool = False
    set_parameters: bool = False
    accepted: tuple[str, ...] = ()
    operator: str = ""
