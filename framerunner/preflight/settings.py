"""How a drone that may be a real one is flown."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from offboard.safety.rules import HOLD_TIME_S, AbortAction

DRY_RUN_S = 15.0
"""Vehicle time for which a dry run lets the mission run."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HardwareSettings:
    """The procedure of one flight; the options of `framerunner fly` of these names.

    Attributes:
        max_speed: cap on the level speed in m/s, whatever the mission asks; with --drone 2 if not given
        max_height: cap on the height above the start in m; the box's ceiling if not given
        dry_run: with --drone, propellers off: checks, camera, mission, setpoints; never arms
        yes: with --drone: checks, but no operator's go; for simulations and CI
        simulated: with --drone: it is a simulation; no checks, no operator, no caps
        set_parameters: with --drone: set failsafe parameters that fail, and keep their old values
        accept: with --drone: fly although the check of this name fails; may be repeated
        on_abort: with --drone: what it does when the flight is aborted
        hold_time: with --on-abort hold: s until it lands, 5 to 100; 30 if not given
        operator_socket: with --drone: socket of a monitor with the operator's page; --monitor has its own
        operator: with --drone: who flies, for the flight card
    """

    max_speed: float | None = None
    max_height: float | None = None
    dry_run: bool = False
    yes: bool = False
    simulated: bool = False
    set_parameters: bool = False
    accept: tuple[str, ...] = ()
    on_abort: AbortAction = "land"
    hold_time: float | None = None
    operator_socket: Path | None = None
    operator: str = ""

    @property
    def needs_go(self) -> bool:
        """An operator gives the go before arming."""
        return not (self.yes or self.dry_run)

    @property
    def hold_s(self) -> float:
        """Vehicle time for which the drone holds before it lands, if it holds."""
        return HOLD_TIME_S if self.hold_time is None else self.hold_time

    @property
    def capped(self) -> bool:
        """Caps on speed or height were asked for."""
        return self.max_speed is not None or self.max_height is not None

    @property
    def asks_nothing(self) -> bool:
        """Nothing of the procedure was asked for; a simulated drone that is recognised needs none."""
        return replace(self, max_speed=None, max_height=None) == HardwareSettings()
