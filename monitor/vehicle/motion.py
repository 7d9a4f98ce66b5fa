"""How the vehicle moves, as it says itself: attitude and local position, in its own axes."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import atan2, cos, hypot, isfinite, sin

from geometry.vectors import Quaternion, Vec3
from monitor.ports import Message

_FAR = 1e6  # metres or metres a second beyond which it is no place and no speed
_RESTART_MS = 3000  # a clock that goes back farther has begun anew; less far back is a late message
_ATTITUDE, _POSITION = 0, 1
_PAST_LENGTH = 128
_NEAR_US = 100_000


@dataclass(frozen=True, slots=True)
class Position:
    """What LOCAL_POSITION_NED says, and where the vehicle looked meanwhile.

    Attributes:
        time_us: vehicle time since boot.
        position_ned_m: shape (3,).
        velocity_ned_m_s: shape (3,).
        yaw_ned_rad: clockwise from north.
    """

    time_us: int
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3
    yaw_ned_rad: float


class Motion:
    """The latest attitude and position, and a short past to compare with.

    Attributes:
        time_us: newest vehicle time heard, since boot.
        attitude_ned: unit quaternion (w, x, y, z), body FRD to NED; None before the first.
        rates_frd_rad_s: of turning, body axes, shape (3,).
        position: None before the first.
        heard_s: when the last attitude and the last position came, loop time.
        counts: attitudes and positions so far.
        restarts: how often the vehicle's clock began anew.
    """

    def __init__(self) -> None:
        self.restarts = 0
        self.counts = [0, 0]
        self._begin()

    def _begin(self) -> None:
        self.time_us = 0
        self.attitude_ned: Quaternion | None = None
        self.rates_frd_rad_s: Vec3 = (0.0, 0.0, 0.0)
        self.position: Position | None = None
        self.heard_s = [-1e9, -1e9]
        self._newest_ms = [0, 0]  # of attitudes, of positions
        self._past: deque[Position] = deque(maxlen=_PAST_LENGTH)
        self._has_quaternion = False

    def take_quaternion(self, message: Message, now_s: float) -> None:
        """Take ATTITUDE_QUATERNION; nonsense is passed over."""
        attitude = (message.q1, message.q2, message.q3, message.q4)
        if self._take_attitude(message, attitude, now_s):
            self._has_quaternion = True

    def take_angles(self, message: Message, now_s: float) -> None:
        """Take ATTITUDE of a vehicle that sends no quaternion."""
        if not self._has_quaternion and isfinite(message.roll + message.pitch + message.yaw):
            self._take_attitude(message, _from_angles(message.roll, message.pitch, message.yaw), now_s)

    def take_position(self, message: Message, now_s: float) -> bool:
        """Take LOCAL_POSITION_NED; False for nonsense, and for one older than the last."""
        x, y, z, vx, vy, vz = message.x, message.y, message.z, message.vx, message.vy, message.vz
        if not abs(x) + abs(y) + abs(z) + abs(vx) + abs(vy) + abs(vz) < _FAR:  # nor is it with a NaN
            return False
        if not self._is_next(_POSITION, message.time_boot_ms):
            return False
        self.position = Position(message.time_boot_ms * 1000, (x, y, z), (vx, vy, vz), self.yaw_ned_rad)
        self._past.append(self.position)
        self.heard_s[_POSITION] = now_s
        self.counts[_POSITION] += 1
        return True

    @property
    def yaw_ned_rad(self) -> float:
        """Heading now, clockwise from north; 0 before the first attitude."""
        if self.attitude_ned is None:
            return 0.0
        w, x, y, z = self.attitude_ned
        return atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))

    @property
    def yaw_rate_left_rad_s(self) -> float:
        """How fast it turns about the vertical, counter-clockwise seen from above."""
        if self.attitude_ned is None:
            return 0.0
        w, x, y, z = self.attitude_ned
        p, q, r = self.rates_frd_rad_s
        return -(2 * (x * z - w * y) * p + 2 * (y * z + w * x) * q + (1 - 2 * (x * x + y * y)) * r)

    def at(self, time_us: int) -> Position | None:
        """Where it was, straight between two reports; None where none is near."""
        after: Position | None = None
        for before in reversed(self._past):
            if before.time_us <= time_us:
                return _between(before, after, time_us)
            after = before
        return after if after is not None and after.time_us - time_us <= _NEAR_US else None

    def _take_attitude(self, message: Message, attitude: Quaternion, now_s: float) -> bool:
        rates = (message.rollspeed, message.pitchspeed, message.yawspeed)
        w, x, y, z = attitude
        norm = hypot(w, x, y, z)
        if not (0.5 < norm < 2.0 and abs(rates[0]) + abs(rates[1]) + abs(rates[2]) < _FAR):
            return False
        if not self._is_next(_ATTITUDE, message.time_boot_ms):
            return False
        self.attitude_ned = (w / norm, x / norm, y / norm, z / norm)
        self.rates_frd_rad_s = rates
        self.heard_s[_ATTITUDE] = now_s
        self.counts[_ATTITUDE] += 1
        return True

    def _is_next(self, kind: int, time_ms: int) -> bool:
        """Follow the vehicle's clock; whether a message is not older than the last one of its kind."""
        if time_ms < self.time_us // 1000 - _RESTART_MS:
            self.restarts += 1
            self._begin()
        elif time_ms < self._newest_ms[kind]:
            return False
        self._newest_ms[kind] = time_ms
        self.time_us = max(self.time_us, time_ms * 1000)
        return True


def _between(before: Position, after: Position | None, time_us: int) -> Position | None:
    if after is None:
        return before if time_us - before.time_us <= _NEAR_US else None
    span_us = after.time_us - before.time_us
    if span_us > 3 * _NEAR_US or span_us <= 0:
        return None
    share = (time_us - before.time_us) / span_us
    a, b = before.position_ned_m, after.position_ned_m
    turn = after.yaw_ned_rad - before.yaw_ned_rad
    turn = atan2(sin(turn), cos(turn))
    return Position(
        time_us,
        (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2])),
        before.velocity_ned_m_s,
        before.yaw_ned_rad + share * turn,
    )


def _from_angles(roll: float, pitch: float, yaw: float) -> Quaternion:
    """A quaternion from ATTITUDE's angles, turned about z, then y, then x."""
    cr, sr = cos(roll / 2), sin(roll / 2)
    cp, sp = cos(pitch / 2), sin(pitch / 2)
    cy, sy = cos(yaw / 2), sin(yaw / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )
