"""Where offboard setpoints wait until they are flown: from the next multiple of 10 ms on.

So a few milliseconds that a packet takes more or less change nothing, nor does one that is sent again, and a
flight over a network repeats as well as one without.
"""

from __future__ import annotations

from collections.abc import Callable

from firmware_py.guidance.modes import Guidance
from firmware_py.guidance.offboard import usable
from firmware_py.types import Setpoint

_GRID_US = 10_000
_WARNING = 4  # MAV_SEVERITY


class OffboardIntake:
    """Takes setpoints that can be flown, one at a time.

    Args:
        guidance: flies them.
        say: takes texts for people, with MAV_SEVERITY.

    Attributes:
        waiting: the newest setpoint that is not flown yet.
        newest: the newest setpoint, flown or not.
    """

    __slots__ = ("_guidance", "_refusal_said", "_say", "_slot", "newest", "waiting")

    def __init__(self, guidance: Guidance, say: Callable[[int, str], None]) -> None:
        self.waiting: Setpoint | None = None
        self.newest: Setpoint | None = None
        self._guidance = guidance
        self._say = say
        self._slot = 0
        self._refusal_said = False

    def offer(self, setpoint: Setpoint, now_us: int) -> bool:
        """Take a setpoint; False, and a text once until a usable one comes, for one that says nothing."""
        if not usable(setpoint):
            if not self._refusal_said:
                self._refusal_said = True
                self._say(_WARNING, "Offboard setpoint ignored: nothing in it can be flown")
            return False
        self._refusal_said = False
        self.waiting = self.newest = setpoint
        self._slot = now_us // _GRID_US
        return True

    def newest_velocity(self) -> tuple[float, float, float, float] | None:
        """The newest setpoint as forward, right, down (m/s) and yaw rate (rad/s, clockwise).

        NaN where it does not control one; None before the first.
        """
        newest = self.newest
        return None if newest is None else (*newest.velocity_level_m_s, newest.yaw_rate_rad_s)

    def pass_on(self, now_us: int) -> None:
        """Fly what waits, if its time has come."""
        if now_us // _GRID_US != self._slot:
            self.pass_on_now()

    def pass_on_now(self) -> None:
        """Fly what waits at once: offboard is entered."""
        if self.waiting is not None:
            self._guidance.accept(self.waiting)
            self.waiting = None
