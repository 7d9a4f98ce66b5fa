"""What a stabiliser may be told to keep below in flight."""

from __future__ import annotations

from math import tan


class TiltLimit:
    """The greatest tilt that following a velocity or an acceleration may ask for.

    Args:
        airframe_tilt_rad: what the airframe can do; nobody can ask for more.

    Attributes:
        tilt_squared: square of the limit, for small angles.
        tilt_tangent: its tangent, horizontal thrust per vertical thrust.
    """

    __slots__ = ("_airframe_tilt_rad", "_tilt_rad", "tilt_squared", "tilt_tangent")

    def __init__(self, airframe_tilt_rad: float) -> None:
        self._airframe_tilt_rad = airframe_tilt_rad
        self.tilt_rad = airframe_tilt_rad

    @property
    def tilt_rad(self) -> float:
        """The limit now; setting more than the airframe can do sets what it can do."""
        return self._tilt_rad

    @tilt_rad.setter
    def tilt_rad(self, tilt_rad: float) -> None:
        self._tilt_rad = tilt_rad = max(0.0, min(tilt_rad, self._airframe_tilt_rad))
        self.tilt_squared = tilt_rad**2
        self.tilt_tangent = tan(tilt_rad)
