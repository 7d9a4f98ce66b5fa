"""Caps on speed and height that hold for every command, whatever a mission asks.

They are applied in the adapters of the `Drone` port, after all corrections, so nothing that commands a drone
can exceed them.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from math import hypot, inf

from framerunner.errors import SettingError
from offboard.drone import DroneState, VelocityCommand
from offboard.keep_in_box import FLOOR_M, Box, confine
from offboard.limits import CommandLimits, clamped

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Caps:
    """The highest speeds and height of a flight; all positive.

    Attributes:
        level_m_s: horizontal speed.
        vertical_m_s: of climb and descent.
        yaw_rate_rad_s: to either side.
        height_m: of the drone's centre above the place of its start; None: the box's ceiling.
    """

    level_m_s: float = 2.0
    vertical_m_s: float = 1.5
    yaw_rate_rad_s: float = 2.0
    height_m: float | None = None

    def box(self, box: Box, start_z_m: float) -> Box:
        """A box whose ceiling is not above the cap; the height of the start is that of the arena's axes."""
        if self.height_m is None:
            return box
        low, high = box.low_m, box.high_m
        ceiling_m = min(high[2], start_z_m + self.height_m)
        if ceiling_m <= low[2] + FLOOR_M:
            raise SettingError(f"--max-height {self.height_m:g}: leaves no room above the floor; give more")
        return replace(box, high_m=(high[0], high[1], ceiling_m))

    @property
    def words(self) -> str:
        """For people."""
        height = "" if self.height_m is None else f", {self.height_m:g} m above the start"
        return (
            f"{self.level_m_s:g} m/s level, {self.vertical_m_s:g} m/s up and down, "
            f"{self.yaw_rate_rad_s:g} rad/s{height}"
        )


class CapKeeper:
    """Applies caps to the commands of one drone, tick by tick, and logs the first time that each acts.

    Args:
        caps: of the flight.
        box: that the drone must not leave; its ceiling is the highest place. None: there is none.

    Attributes:
        acted: the caps that have acted so far, by name.
    """

    def __init__(self, caps: Caps, box: Box | None) -> None:
        self.acted: set[str] = set()
        self._caps = caps
        self._box = box
        self._limits = CommandLimits(
            forward_m_s=caps.level_m_s,
            left_m_s=caps.level_m_s,
            up_m_s=caps.vertical_m_s,
            down_m_s=caps.vertical_m_s,
            yaw_rate_rad_s=caps.yaw_rate_rad_s,
            level_m_s=caps.level_m_s,
        )

    def limit(self, command: VelocityCommand, state: DroneState | None) -> VelocityCommand:
        """The command that may be sent; the same object if no cap acts.

        Args:
            command: wanted.
            state: of the drone now; None before the first, when only the speeds are capped.
        """
        command = self._capped_speed(command)
        if self._box is None or state is None:
            return command
        kept, sides = confine(command, state, self._box)
        if not sides:
            return command
        self._note("place", f"kept in by the cap: {sides}")
        return self._capped_speed(kept)  # beyond a side it leads back, at a speed of its own

    def _capped_speed(self, command: VelocityCommand) -> VelocityCommand:
        caps, limits = self._caps, self._limits
        if not command.is_number:
            self._note("numbers", "a command is not a number, so the drone hovers")
            return VelocityCommand()
        forward_m_s, left_m_s = self._capped_level(command.forward_m_s, command.left_m_s)
        up_m_s = clamped(command.up_m_s, limits.down_m_s, limits.up_m_s)
        rate_rad_s = clamped(command.yaw_rate_rad_s, limits.yaw_rate_rad_s, limits.yaw_rate_rad_s)
        kept = VelocityCommand(forward_m_s, left_m_s, up_m_s, rate_rad_s)
        if kept == command:
            return command
        if (forward_m_s, left_m_s) != (command.forward_m_s, command.left_m_s):
            level_m_s = hypot(command.forward_m_s, command.left_m_s)
            self._note("level speed", f"{level_m_s:.2f} m/s level commanded, {caps.level_m_s:g} flown")
        if up_m_s != command.up_m_s:
            self._note("vertical speed", f"{command.up_m_s:.2f} m/s upwards commanded, {up_m_s:g} flown")
        if rate_rad_s != command.yaw_rate_rad_s:
            self._note("yaw rate", f"{command.yaw_rate_rad_s:.2f} rad/s commanded, {rate_rad_s:g} flown")
        return kept

    def _capped_level(self, forward_m_s: float, left_m_s: float) -> tuple[float, float]:
        level_m_s, most_m_s = hypot(forward_m_s, left_m_s), self._caps.level_m_s
        if level_m_s == inf:
            return self._limits.level(forward_m_s, left_m_s)
        share = most_m_s / level_m_s if level_m_s > most_m_s else 1.0
        return share * forward_m_s, share * left_m_s

    def _note(self, cap: str, words: str) -> None:
        if cap not in self.acted:
            self.acted.add(cap)
            logger.warning("cap on %s: %s (said once)", cap, words)
