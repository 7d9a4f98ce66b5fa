"""What numbers become on a link: MAVLink carries single precision, MAVSDK goes through degrees.

The paper's navigator decides by single pixels, so even a ten-millionth of a metre may turn a flight. With the
link's rounding in it, a lockstep flight is the same as one over UDP until something else differs.
"""

from __future__ import annotations

from math import degrees, pi, radians
from struct import Struct

from geometry.vectors import Vec3

_ONE = Struct("<f")
_THREE = Struct("<3f")


def single(vector: Vec3) -> Vec3:
    """A vector, shape (3,), rounded to single precision."""
    x, y, z = _THREE.unpack(_THREE.pack(*vector))
    return (x, y, z)


def told_yaw(yaw_rad: float) -> float:
    """A yaw as ATTITUDE and then MAVSDK's degrees bring it, radians.

    MAVSDK multiplies by 180/pi in single precision. A product of two singles is exact in double precision,
    so rounding it once gives the same.
    """
    return radians(_rounded(_DEGREES * _rounded(yaw_rad)))


def sent_yaw_rate(yaw_rate_rad_s: float) -> float:
    """A yaw rate as it is on the wire after MAVSDK has turned it from degrees, rad/s."""
    return _rounded(_RADIANS * _rounded(degrees(yaw_rate_rad_s)))


def _rounded(value: float) -> float:
    rounded: float = _ONE.unpack(_ONE.pack(value))[0]
    return rounded


_DEGREES = _rounded(180.0 / _rounded(pi))
_RADIANS = _rounded(_rounded(pi) / 180.0)
