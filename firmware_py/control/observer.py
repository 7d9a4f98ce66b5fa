"""Learns what pushes or turns the vehicle beside its own rotors."""

from __future__ import annotations

from geometry.vectors import Vec3


class DisturbanceObserver:
    """Estimates an unknown acceleration per axis from a velocity and the acceleration that was expected.

    A Luenberger observer of v' = a + d, d' = 0 with both poles at one bandwidth (Franklin, Powell & Workman,
    "Digital Control of Dynamic Systems", 1998, section 8.5). Subtracting d from what is asked for is
    integral action that cannot wind up, because `a` is what the limits have left of it; and it goes on
    whatever is followed, so that changing that needs no care.

    Args:
        bandwidth_rad_s: of both poles.
        period_s: time between corrections.
        limit: d is kept within plus and minus this, per axis.
    """

    __slots__ = ("_fresh", "_gain", "_gain_d", "_limit", "_period_s", "_x", "_y", "_z", "d")

    def __init__(self, bandwidth_rad_s: float, period_s: float, limit: float) -> None:
        self._period_s = period_s
        self._gain = 2.0 * bandwidth_rad_s * period_s
        self._gain_d = bandwidth_rad_s**2 * period_s
        self._limit = limit
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._x = self._y = self._z = 0.0
        self._fresh = True
        self.d: Vec3 = (0.0, 0.0, 0.0)

    def hold(self, velocity: Vec3) -> None:
        """Learn nothing in this period: something unknown carries the vehicle."""
        self._x, self._y, self._z = velocity
        self._fresh = False

    def correct(self, velocity: Vec3) -> None:
        """Compare the velocity with the one predicted; update `d`."""
        if self._fresh:
            self.hold(velocity)
            return
        x, y, z = velocity
        x, y, z = x - self._x, y - self._y, z - self._z
        gain, gain_d, limit = self._gain, self._gain_d, self._limit
        self._x += gain * x
        self._y += gain * y
        self._z += gain * z
        dx, dy, dz = self.d
        dx, dy, dz = dx + gain_d * x, dy + gain_d * y, dz + gain_d * z
        if max(dx, dy, dz, -dx, -dy, -dz) > limit:
            dx, dy, dz = _clamp(dx, limit), _clamp(dy, limit), _clamp(dz, limit)
        self.d = (dx, dy, dz)

    def predict(self, x: float, y: float, z: float) -> None:
        """Go on by one period with the acceleration expected from what was commanded."""
        dx, dy, dz = self.d
        period_s = self._period_s
        self._x += (x + dx) * period_s
        self._y += (y + dy) * period_s
        self._z += (z + dz) * period_s


def _clamp(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))
