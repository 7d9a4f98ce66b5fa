"""The MAVLink messages that carry a pose."""

from __future__ import annotations

from math import nan

from framerunner.geometry.rotations import euler_from_quaternion
from framerunner.mocap.facts import SendSettings
from framerunner.mocap.motion import body_velocity
from framerunner.mocap.poses import MeasuredPose
from framerunner.wire.dialect import Message, mavlink

_DIAGONAL = (0, 6, 11, 15, 18, 20)
_QUALITY = 100


def odometry(pose: MeasuredPose, stamp_us: int, settings: SendSettings, frame: int) -> Message:
    """An ODOMETRY of the type VISION.

    Args:
        pose: what is sent; without a velocity that of the message is NaN.
        stamp_us: when it was taken.
        settings: its standard deviations.
        frame: MAV_FRAME of position and attitude; the velocity is in MAV_FRAME_BODY_FRD.
    """
    velocity = pose.velocity_ned_m_s
    body = (nan, nan, nan) if velocity is None else body_velocity(pose.attitude, velocity)
    return mavlink.MAVLink_odometry_message(
        stamp_us,
        frame,
        mavlink.MAV_FRAME_BODY_FRD,
        *pose.position_ned_m,
        list(pose.attitude),
        *body,
        nan,
        nan,
        nan,
        _pose_covariance(settings),
        _covariance(settings.velocity_sigma_m_s**2, nan),
        0,
        mavlink.MAV_ESTIMATOR_TYPE_VISION,  # PX4's estimator ignores the type MOCAP
        _QUALITY,
    )


def vision_position(pose: MeasuredPose, stamp_us: int, settings: SendSettings) -> Message:
    """A VISION_POSITION_ESTIMATE; it has no velocity.

    Args:
        pose: what is sent.
        stamp_us: when it was taken.
        settings: its standard deviations.
    """
    return mavlink.MAVLink_vision_position_estimate_message(
        stamp_us,
        *pose.position_ned_m,
        *euler_from_quaternion(pose.attitude),
        _pose_covariance(settings),
    )


def _pose_covariance(settings: SendSettings) -> list[float]:
    entries = _covariance(settings.position_sigma_m**2, settings.attitude_sigma_rad**2)
    if settings.height_sigma_m is not None:
        entries[_DIAGONAL[2]] = settings.height_sigma_m**2
    return entries


def _covariance(first: float, second: float) -> list[float]:
    """A covariance matrix with the same variance three times, and another one three times."""
    entries = [nan] * 21
    for index, variance in zip(_DIAGONAL, (first,) * 3 + (second,) * 3, strict=True):
        entries[index] = variance
    return entries
