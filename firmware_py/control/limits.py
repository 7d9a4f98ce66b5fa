"""What a stabiliser may be told to keep below in flight."""

from __future__ import annotations

from math import inf, tan


class FlightLimits:
    """The greatest tilt that following a velocity or an acceleration may ask for, and other bounds.

    Args:
        airframe_tilt_rad: what the airframe can do; nobody can ask for more.

    Attributes:
        rate_rad_s: of roll and pitch together, where an attitude is turned to by the vector law.
        min_thrust: where the height is controlled, as a share of full thrust.
        max_thrust: the same.
        tilt_squared: square of the limit, for small angles.
        tilt_tangent: its tangent, horizontal thrust per vertical thrust.
    """

    __slots__ = (
        "_airframe_tilt_rad",
        "_tilt_rad",
        "max_thrust",
        "min_thrust",
        "rate_rad_s",
        "tilt_squared",
        "tilt_tangent",
    )

    def __init__(self, airframe_tilt_rad: float) -> None:
        self._airframe_tilt_rad = airframe_tilt_rad
        self.tilt_rad = airframe_tilt_rad
        self.rate_rad_s = inf
        self.min_thrust = 0.0
        self.max_thrust = 1.0

    @property
    def tilt_rad(self) -> float:
        """The limit now; setting more than the airframe can do sets what it can do."""
        return self._tilt_rad

    @tilt_rad.setter
    def tilt_rad(self, tilt_rad: float) -> None:
        self._tilt_rad = tilt_rad = max(0.0, min(tilt_rad, self._airframe_tilt_rad))
        self.tilt_squared = tilt_rad**2
        self.tilt_tangent = tan(tilt_rad)
