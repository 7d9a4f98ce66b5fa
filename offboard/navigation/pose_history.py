"""Where the drone was when an image was exposed, from the states that telemetry reported."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, field
from math import acos, dist, hypot, remainder, tau
from typing import Generic, TypeVar

from framerunner.geometry.rotations import interpolated, multiply, quaternion_from_yaw, yaw_of
from framerunner.geometry.vectors import Quaternion, Vec3
from offboard.drone import DroneState
from offboard.navigation.camera_model import CameraModel

KEPT_US = 2_000_000
EXTRAPOLATED_US = 100_000  # how far before the first and after the last sample a pose is still given
LONGEST_GAP_US = 300_000  # between two samples; what happened in a longer one is not known

# Errors of the pose, for those who weigh what they compute with it.
POSITION_STD_M = 0.001
ATTITUDE_STD_RAD = 0.0025
JITTER_S = 0.002  # of the time stamps: the faster the drone moves and turns, the less exact is its pose
EXTRAPOLATION_STD_M_S2 = 3.0  # acceleration, of which extrapolation knows nothing
EXTRAPOLATION_STD_RAD_S = 0.2


@dataclass(frozen=True, slots=True)
class DronePose:
    """The drone at one instant, arena axes.

    Attributes:
        time_us: vehicle time.
        position_m: of its centre.
        attitude_arena: body FLU to arena.
        position_std_m: standard deviation of each coordinate.
        attitude_std_rad: standard deviation about each axis.
    """

    time_us: int
    position_m: Vec3
    attitude_arena: Quaternion
    position_std_m: float = POSITION_STD_M
    attitude_std_rad: float = ATTITUDE_STD_RAD


@dataclass(frozen=True, slots=True)
class PoseCorrection:
    """Of a reported pose.

    Attributes:
        position_m: of the drone's centre.
        turn_rad: to be added to the heading.
        std_m: of the place in an image, relative to others.
    """

    position_m: Vec3
    turn_rad: float
    std_m: float


class PoseChange:
    """Tells when the drone's pose is a new one: moved or turned by more than some thresholds."""

    def __init__(self, moved_m: float, turned_rad: float) -> None:
        self._moved_m, self._turned_rad = moved_m, turned_rad
        self._last: tuple[Vec3, float] | None = None

    def is_new(self, position_m: Vec3, attitude_arena: Quaternion) -> bool:
        """Whether a pose differs from the last one that was new."""
        yaw_rad = yaw_of(attitude_arena)
        if self._last is not None:
            moved_m, turned_rad = dist(position_m, self._last[0]), remainder(yaw_rad - self._last[1], tau)
            if moved_m < self._moved_m and abs(turned_rad) < self._turned_rad:
                return False
        self._last = (position_m, yaw_rad)
        return True


Value = TypeVar("Value")


@dataclass(slots=True)
class _Samples(Generic[Value]):
    """Values by their times, in order of time."""

    times_us: list[int] = field(default_factory=list)
    values: list[Value] = field(default_factory=list)

    def add(self, time_us: int, value: Value) -> None:
        """Put a value in its place and forget those that are too old."""
        times_us, values = self.times_us, self.values
        if not times_us or time_us > times_us[-1]:
            times_us.append(time_us)
            values.append(value)
            old = bisect_left(times_us, time_us - KEPT_US)
            del times_us[:old], values[:old]
            return
        place = bisect_left(times_us, time_us)
        if times_us[place] != time_us and time_us >= times_us[-1] - KEPT_US:
            times_us.insert(place, time_us)
            values.insert(place, value)


class PoseHistory:
    """The last two seconds of the drone's motion.

    Positions and attitudes are reported with times of their own, so they are kept apart.

    Args:
        camera: if it is on a gimbal, or turned on the drone, poses are those of a drone along whose axis it
            would look (`carrier`); None: it looks along the drone's.
    """

    def __init__(self, camera: CameraModel | None = None) -> None:
        self._camera = camera
        self._camera_attitudes: _Samples[Quaternion] = _Samples()
        self._positions: _Samples[tuple[Vec3, Vec3]] = _Samples()  # metres; velocity, metres a second
        self._attitudes: _Samples[Quaternion] = _Samples()

    def add(self, state: DroneState) -> None:
        """Add a state; a late one is put in its place, a repeated one changes nothing."""
        position_us = state.time_us - round(state.position_age_s * 1e6)
        self._positions.add(position_us, ((state.x, state.y, state.z), state.velocity_arena_m_s))
        self._attitudes.add(state.time_us, state.attitude_arena)
        if state.camera_attitude_arena is not None:
            self._camera_attitudes.add(state.time_us, state.camera_attitude_arena)

    def at(self, time_us: int, correction: PoseCorrection | None = None) -> DronePose | None:
        """The pose at a vehicle time; None if the states around it are missing.

        Args:
            time_us: vehicle time.
            correction: of the reported pose; None: it is taken as reported.
        """
        attitude = self._attitude_at(self._attitudes, time_us)
        if attitude is None:
            return None
        if correction is None:
            position = self._position_at(time_us)
            if position is None:
                return None
            return self._pose(time_us, position, attitude, 0.0)
        return self._pose(time_us, (correction.position_m, correction.std_m), attitude, correction.turn_rad)

    def _pose(
        self, time_us: int, position: tuple[Vec3, float], attitude: tuple[Quaternion, float], turn_rad: float
    ) -> DronePose | None:
        (place_m, place_std_m), camera = position, self._camera
        if turn_rad:
            attitude = turned_by(turn_rad, attitude[0]), attitude[1]
        looking = attitude
        if camera is not None and camera.on_gimbal:
            turned = self._attitude_at(self._camera_attitudes, time_us)
            if turned is None:
                return None
            looking = turned_by(turn_rad, turned[0]) if turn_rad else turned[0], turned[1]
        elif camera is not None and camera.mounting is not None:
            looking = multiply(attitude[0], camera.mounting), attitude[1]
        if camera is not None and looking is not attitude:
            place_m = camera.carrier(place_m, attitude[0], looking[0])
        return DronePose(time_us, place_m, looking[0], place_std_m, looking[1])

    def _position_at(self, time_us: int) -> tuple[Vec3, float] | None:
        """Position and its standard deviation, metres: a cubic Hermite spline, straight lines at the ends."""
        times, samples = self._positions.times_us, self._positions.values
        place = bisect_left(times, time_us)
        if not 0 < place < len(times):
            nearest = 0 if place == 0 else len(times) - 1
            if not times or abs(time_us - times[nearest]) > EXTRAPOLATED_US:
                return None
            away_s = (time_us - times[nearest]) * 1e-6
            (x, y, z), (vx, vy, vz) = samples[nearest]
            std_m = POSITION_STD_M + JITTER_S * hypot(vx, vy, vz) + EXTRAPOLATION_STD_M_S2 / 2 * away_s**2
            return (x + away_s * vx, y + away_s * vy, z + away_s * vz), std_m
        gap_us = times[place] - times[place - 1]
        if gap_us > LONGEST_GAP_US:
            return None
        gap_s = gap_us * 1e-6
        t = (time_us - times[place - 1]) / gap_us
        (p0, v0), (p1, v1) = samples[place - 1], samples[place]
        after = t * t * (3.0 - 2.0 * t)
        start, end = gap_s * t * (1.0 - t) ** 2, gap_s * t * t * (t - 1.0)
        x, y, z = (
            a + after * (b - a) + start * va + end * vb for a, b, va, vb in zip(p0, p1, v0, v1, strict=True)
        )
        return (x, y, z), POSITION_STD_M + JITTER_S * hypot(*v1)

    def _attitude_at(self, known: _Samples[Quaternion], time_us: int) -> tuple[Quaternion, float] | None:
        """Attitude and its standard deviation, radians; the last turn goes on at the ends."""
        times, samples = known.times_us, known.values
        place = bisect_left(times, time_us)
        if not times:
            return None
        away_us = max(times[0] - time_us, time_us - times[-1], 0)
        if away_us > EXTRAPOLATED_US:
            return None
        std_rad = ATTITUDE_STD_RAD + EXTRAPOLATION_STD_RAD_S * away_us * 1e-6
        if len(times) == 1:
            return samples[0], std_rad
        place = min(max(place, 1), len(times) - 1)
        gap_us = times[place] - times[place - 1]
        if gap_us > LONGEST_GAP_US:
            return None
        before, after = samples[place - 1], samples[place]
        attitude = interpolated(before, after, (time_us - times[place - 1]) / gap_us)
        return attitude, std_rad + JITTER_S * _angle_rad(before, after) / (gap_us * 1e-6)


def _angle_rad(a: Quaternion, b: Quaternion) -> float:
    """The angle between two attitudes."""
    return 2.0 * acos(min(1.0, abs(sum(p * q for p, q in zip(a, b, strict=True)))))


def turned_by(turn_rad: float, attitude: Quaternion) -> Quaternion:
    """An attitude, turned about the vertical."""
    return multiply(quaternion_from_yaw(turn_rad), attitude)
