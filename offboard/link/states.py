"""The drone's state in arena axes from a vehicle's telemetry."""

from __future__ import annotations

from geometry.axes import Alignment, Pose
from geometry.rotations import quaternion_from_euler
from offboard.drone import DroneState
from offboard.link.telemetry import Sample, TelemetryFeed


def drone_state(
    feed: TelemetryFeed,
    alignment: Alignment,
    offboard_mode: str,
    sample: Sample,
    missed: tuple[DroneState, ...] = (),
) -> DroneState:
    """The state at a tick.

    Args:
        feed: the vehicle's telemetry, whose mode and arming are the latest.
        alignment: from the vehicle's local axes to the arena's.
        offboard_mode: name of the mode in which the vehicle follows this app's setpoints.
        sample: where the vehicle was at the tick.
        missed: the states at the ticks that were skipped before it.
    """
    pose = alignment.pose(Pose(sample.position_ned_m, sample.yaw_ned_rad))
    attitude_ned = quaternion_from_euler(sample.roll_rad, sample.pitch_rad, sample.yaw_ned_rad)
    return DroneState(
        time_us=sample.time_us,
        x=pose.position_m[0],
        y=pose.position_m[1],
        z=pose.position_m[2],
        yaw=pose.yaw_rad,
        velocity_arena_m_s=alignment.vector(sample.velocity_ned_m_s),
        armed=feed.arming.is_armed(sample.time_us),
        offboard=feed.mode == offboard_mode,
        mode=feed.mode,
        landed=feed.landed,
        position_age_s=max(0.0, (sample.time_us - sample.position_us) * 1e-6),
        attitude_arena=alignment.attitude(attitude_ned),
        missed=missed,
    )
