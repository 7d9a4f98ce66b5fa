"""The lockstep drone moved on by plain calls, for whoever has no event loop."""

from __future__ import annotations

from collections.abc import Coroutine

from framerunner.lockstep_drone import LINK_LOST_US, LockstepDrone
from offboard.drone import DroneError, DroneState


class SteppedDrone(LockstepDrone):
    """A simulated vehicle that gives its ticks one by one."""

    def next_state(self) -> DroneState:
        """Let time pass until the next of the ticks that `ticks()` would give.

        Raises:
            DroneError: values not finite, a failsafe took over or disarmed the vehicle.
        """
        self._sample = None
        came = self._passes(lambda: self._sample is not None, LINK_LOST_US)
        told: DroneState | None = self._sample
        if not came or told is None:
            raise DroneError("link lost: the vehicle's clock stands still")
        self._pass(self._delay_us)
        self._check(told)
        return told


def run_through(coroutine: Coroutine[object, None, None]) -> None:
    """Run a coroutine of the lockstep drone, none of which ever waits.

    Args:
        coroutine: not yet begun.

    Raises:
        RuntimeError: it waits after all.
    """
    try:
        coroutine.send(None)
    except StopIteration:
        return
    coroutine.close()
    raise RuntimeError("a coroutine of the lockstep drone waits for something; nothing can come of it here")
