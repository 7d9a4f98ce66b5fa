"""Resets of the vehicle's estimator, which turn or move its local frame under a flying app.

PX4 counts them in ODOMETRY.reset_counter: it takes a new heading from its compass when it has left the
ground, and a new position when its sensors disagree with it for long. Framerunner's own autopilot is not
watched: it only returns to the frame of its sensors, and its flights in lockstep do the same.
"""

from __future__ import annotations

import contextlib
import logging
from collections import deque
from dataclasses import dataclass
from math import degrees, dist, isfinite, pi, radians, remainder
from typing import Any

from mavsdk.asyncio import MavsdkError

from framerunner.geometry.axes import ArenaAlignment, Pose
from framerunner.geometry.rotations import rotation, to_world, yaw_of
from framerunner.geometry.vectors import Vec3
from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, Message, mavlink
from framerunner.wire.vehicle_telemetry import MessageOrder
from offboard.drone import DroneError
from offboard.link.direct import subscribe

RATE_HZ = 10.0
MAX_STEP_S = 0.3  # between two reports, from which a jump can be told from motion
MAX_MOVE_M = 0.3  # of the position in a reset; the vehicle's fence is so far from the app's box
MIN_TURN_RAD = radians(1.0)  # a smaller one is not told from motion
logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Jump:
    """A reset: where the vehicle would be without it, and where it reports to be; local NED."""

    expected: Pose
    reported: Pose


@dataclass(frozen=True, slots=True)
class _Report:
    """An ODOMETRY: local NED, vehicle time."""

    time_us: int
    resets: int
    pose: Pose
    velocity_ned_m_s: Vec3
    yaw_rate_rad_s: float

    def after(self, step_s: float) -> Pose:
        """The pose with constant rates."""
        x, y, z = (at + step_s * v for at, v in zip(self.pose.position_m, self.velocity_ned_m_s, strict=True))
        return Pose((x, y, z), self.pose.yaw_rad + step_s * self.yaw_rate_rad_s)


class ResetFeed:
    """Collects resets on MAVSDK's thread.

    Attributes:
        heard: the vehicle reports how often its estimator was reset.
    """

    def __init__(self) -> None:
        self.heard = self._is_wanted = False
        self._order = MessageOrder()
        self._last: _Report | None = None
        self._jumps: deque[Jump | None] = deque(maxlen=100)

    def subscribe(self, direct: Any) -> None:  # noqa: ANN401 - MAVSDK is untyped
        """Subscribe to MAVSDK's synchronous plugin `mavlink_direct`."""
        self._is_wanted = True
        subscribe(direct, "ODOMETRY", self._on_odometry)

    async def request(self, plugin: Any) -> None:  # noqa: ANN401
        """Request reports, by MAVSDK's asyncio `telemetry`, if the vehicle sends none; it may refuse."""
        if self._is_wanted and not self.heard:
            with contextlib.suppress(MavsdkError):
                await plugin.set_rate_odometry(RATE_HZ)

    def take(self) -> list[Jump | None]:
        """The resets since the last call, oldest first; None: by how much is not known."""
        return [self._jumps.popleft() for _ in range(len(self._jumps))]

    def _on_odometry(self, message: Message) -> None:
        is_autopilots = message.get_srcComponent() == AUTOPILOT_COMPONENT_ID
        if not is_autopilots or message.frame_id != mavlink.MAV_FRAME_LOCAL_NED:
            return  # it is for the vehicle, or of another frame
        now, last = _report(message), self._last
        if not self._order.is_next(now.time_us):
            return
        self.heard, self._last = True, now
        if last is None or now.resets == last.resets:
            return
        step_s = (now.time_us - last.time_us) * 1e-6
        jump = Jump(last.after(step_s), now.pose)
        numbers = (*jump.expected.position_m, *jump.reported.position_m, jump.expected.yaw_rad)
        known = 0.0 < step_s <= MAX_STEP_S and isfinite(sum(numbers) + jump.reported.yaw_rad)
        self._jumps.append(jump if known else None)


def followed(alignment: ArenaAlignment, jump: Jump | None, *, drifts: bool) -> ArenaAlignment:
    """The alignment after a reset: the drone has not moved, but its north may be another.

    A small change of the position is a correction within the frame, and stays one.

    Args:
        alignment: before it.
        jump: the reset.
        drifts: the vehicle is not sure of its position, and the app can estimate it. What it reports is then
            continued from where the drone was.

    Raises:
        DroneError: where the drone is is not known any more.
    """
    if jump is None:
        raise DroneError("the vehicle's estimator was reset, and by how much is not known")
    moved_m = dist(jump.expected.position_m, jump.reported.position_m)
    turned_rad = remainder(jump.reported.yaw_rad - jump.expected.yaw_rad, 2 * pi)
    moves, turns = moved_m > MAX_MOVE_M, abs(turned_rad) >= MIN_TURN_RAD
    if moves and not drifts:
        raise DroneError(f"the vehicle's estimator was reset, and moved its position by {moved_m:.1f} m")
    if not (moves or turns):
        return alignment
    logger.warning(
        "the vehicle's estimator was reset: north by %.0f°, its position by %.1f m; the app follows",
        degrees(turned_rad),
        moved_m,
    )
    position_m = (jump.expected if moves else jump.reported).position_m
    yaw_rad = (jump.expected if turns else jump.reported).yaw_rad
    return ArenaAlignment(alignment.pose(Pose(position_m, yaw_rad)), jump.reported)


def _report(message: Message) -> _Report:
    w, x, y, z = message.q
    attitude, velocity = (w, x, y, z), (message.vx, message.vy, message.vz)
    matrix = rotation(attitude)
    if message.child_frame_id != mavlink.MAV_FRAME_LOCAL_NED:
        velocity = to_world(matrix, *velocity)
    pose = Pose((message.x, message.y, message.z), yaw_of(attitude))
    _, _, yaw_rate_rad_s = to_world(matrix, message.rollspeed, message.pitchspeed, message.yawspeed)
    return _Report(message.time_usec, message.reset_counter, pose, velocity, yaw_rate_rad_s)
