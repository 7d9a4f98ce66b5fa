"""Where the arena is at the vehicle: it lies so that the vehicle, waiting disarmed, stands on the start."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import atan2, cos, sin

from geometry.axes import Alignment, Pose
from geometry.rotations import yaw_of
from geometry.vectors import Quaternion, Vec3
from wire.vehicle_telemetry import VehiclePose

HELD_AFTER_FLIGHT_US = 10_000_000  # the verdict is made by then; later the vehicle is put back on its start
_PENDING = 200  # poses between two heartbeats


@dataclass(frozen=True, slots=True)
class ArenaPose:
    """A vehicle's pose in the arena.

    Attributes:
        position_arena_m: shape (3,).
        velocity_arena_m_s: shape (3,).
        attitude_arena: unit quaternion (w, x, y, z), body FLU to arena.
    """

    position_arena_m: Vec3
    velocity_arena_m_s: Vec3
    attitude_arena: Quaternion


class Placement:
    """Lays the arena under a disarmed vehicle, and keeps it where it is while the vehicle flies.

    Only heartbeats tell of arming, once a second, so the vehicle may have taken off before one says so.
    Poses therefore wait until the next heartbeat confirms that they were taken disarmed; the arena is laid
    by their mean.

    Args:
        start: where the vehicle stands, arena axes; its z is that of the vehicle's centre.

    Attributes:
        alignment: from local NED to arena; None until the vehicle was seen disarmed.
        armed: as the last heartbeat says; None before the first.
    """

    def __init__(self, start: Pose) -> None:
        self._start = start
        self._pending: deque[tuple[Vec3, float]] = deque(maxlen=_PENDING)
        self._rest: Pose | None = None
        self._landed_us: int | None = None
        self.alignment: Alignment | None = None
        self.armed: bool | None = None

    def see_pose(self, pose: VehiclePose) -> None:
        """Take a pose; while the vehicle is armed it changes nothing."""
        if not self.armed:
            self._pending.append((pose.position_ned_m, yaw_of(pose.attitude_ned)))

    def see_heartbeat(self, time_us: int, armed: bool) -> None:
        """Take what a heartbeat says.

        Args:
            time_us: vehicle time by now, microseconds.
            armed: motors on.
        """
        if armed:
            if not self.armed and self._rest is not None:  # a try begins: from where it really stood
                self.alignment = Alignment(self._start, self._rest)
            self._landed_us = None
        else:
            if self.armed:
                self._landed_us = time_us
            self._confirm(time_us)
        self.armed = armed
        self._pending.clear()

    def arena_pose(self, pose: VehiclePose) -> ArenaPose | None:
        """A pose in arena axes; None as long as the arena has no place."""
        if self.alignment is None:
            return None
        return ArenaPose(
            self.alignment.position(pose.position_ned_m),
            self.alignment.vector(pose.velocity_ned_m_s),
            self.alignment.attitude(pose.attitude_ned),
        )

    def _confirm(self, time_us: int) -> None:
        """The poses since the last heartbeat were taken disarmed."""
        if not self._pending or self.armed:
            return
        self._rest = _mean(self._pending)
        if self._landed_us is not None and time_us - self._landed_us < HELD_AFTER_FLIGHT_US:
            return
        self.alignment = Alignment(self._start, self._rest)


def _mean(poses: deque[tuple[Vec3, float]]) -> Pose:
    count = len(poses)
    north, east, down = (sum(position[axis] for position, _ in poses) / count for axis in range(3))
    yaw_rad = atan2(sum(sin(yaw) for _, yaw in poses), sum(cos(yaw) for _, yaw in poses))
    return Pose((north, east, down), yaw_rad)
