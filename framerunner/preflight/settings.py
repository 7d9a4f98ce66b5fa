"""How a drone that may be a real one is flown."""

from __future__ import annotations

from dataclasses import dataclass, replace

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
        capped: caps on speed or height were asked for.
    """

    needs_go: bool = True
    abort: AbortAction = "land"
    dry_run: bool = False
    set_parameters: bool = False
    accepted: tuple[str, ...] = ()
    operator: str = ""
    capped: bool = False

    @property
    def asks_nothing(self) -> bool:
        """Nothing of the procedure was asked for; a simulated drone that is recognised needs none."""
        return replace(self, capped=False) == HardwareSettings()
