"""A vehicle's state in arena axes, as its telemetry reported it at a tick."""

from __future__ import annotations

from framerunner.geometry.axes import ArenaAlignment, Pose
from offboard.drone import DroneState
from offboard.link.dialect import Dialect
from offboard.link.inertial import InertialFeed
from offboard.link.telemetry import TelemetryFeed, TelemetrySample


def reported_state(
    sample: TelemetrySample,
    feed: TelemetryFeed,
    alignment: ArenaAlignment,
    dialect: Dialect,
    missed: tuple[DroneState, ...] = (),
    *,
    inertial: InertialFeed | None = None,
) -> DroneState:
    """The state at a tick.

    Args:
        sample: of the tick.
        feed: for mode and arming, which have no time stamps.
        alignment: from the vehicle's local axes to the arena's.
        dialect: of the vehicle.
        missed: states at the ticks that were skipped before this one, oldest first.
        inertial: for the IMU's samples since the state before; None: without them.
    """
    pose = alignment.pose(Pose(sample.position_ned_m, sample.yaw_ned_rad))
    camera_ned = sample.camera_attitude_ned
    return DroneState(
        time_us=sample.time_us,
        x=pose.position_m[0],
        y=pose.position_m[1],
        z=pose.position_m[2],
        yaw=pose.yaw_rad,
        velocity_arena_m_s=alignment.vector(sample.velocity_ned_m_s),
        armed=feed.arming.is_armed(sample.time_us),
        offboard=feed.mode == dialect.kind.modes.offboard,
        mode=feed.mode,
        landed=sample.landed,
        position_age_s=max(0.0, (sample.time_us - sample.position_us) * 1e-6),
        attitude_arena=alignment.attitude(sample.attitude_ned),
        camera_attitude_arena=None if camera_ned is None else alignment.attitude(camera_ned),
        imu=() if inertial is None else inertial.take(sample.time_us),
        accuracy=None if inertial is None else inertial.accuracy,
        missed=missed,
    )
