"""Poses from motion capture and visual odometry: ODOMETRY, VISION_POSITION_ESTIMATE and ATT_POS_MOCAP.

As PX4 v1.17 (mavlink_receiver.cpp and EKF2.cpp): any component may send them; time stamps are converted by
TIMESYNC; variances are those of the message or of the parameters EKF2_EV..., whichever are larger. Poses of
the type MOCAP and ATT_POS_MOCAP are accepted and used for nothing.

Differences: velocities are not used; position and height are used together or not at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from enum import IntFlag
from math import hypot, isfinite

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import AutopilotService
from firmware_py.mavlink.time_sync import Clocks
from firmware_py.parameters import Parameters
from framerunner.geometry.rotations import normalized, quaternion_from_euler
from framerunner.geometry.vectors import NAN3, Quaternion, Vec3
from framerunner.vehicle.measurements import ExternalPose
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

_NORM_TOLERANCE = 1e-5  # of a quaternion's length, PX4's
_REPEAT_TEXT_US = 1_000_000
_TAKEN = frozenset(
    {
        mavlink.MAV_ESTIMATOR_TYPE_UNKNOWN,
        mavlink.MAV_ESTIMATOR_TYPE_NAIVE,
        mavlink.MAV_ESTIMATOR_TYPE_VISION,
        mavlink.MAV_ESTIMATOR_TYPE_VIO,
    }
)
_UNUSED = mavlink.MAV_ESTIMATOR_TYPE_MOCAP
_NAIVE = mavlink.MAV_ESTIMATOR_TYPE_NAIVE  # without covariances


class _Use(IntFlag):
    """Bits of EKF2_EV_CTRL."""

    HORIZONTAL = 1
    HEIGHT = 2
    VELOCITY = 4
    YAW = 8


def usable_pose(received: ExternalPose, quality: int, parameters: Parameters) -> ExternalPose | None:
    """What the parameters let the estimator use of a pose; None: nothing.

    Args:
        received: of the time at which it was true, as far as its sender knows; NaN: not given; its
            attitude is not necessarily of unit length.
        quality: percent; 0: not given.
        parameters: EKF2_EV.
    """
    value = parameters.value
    use = _Use(parameters.integer("EKF2_EV_CTRL"))
    required = _Use.HORIZONTAL | _Use.HEIGHT
    if use & required != required or not all(map(isfinite, received.position_ned_m)):
        return None
    worst = parameters.integer("EKF2_EV_QMIN")
    if worst > 0 and quality < worst:
        return None
    of_message = parameters.integer("EKF2_EV_NOISE_MD") == 0
    return replace(
        received,
        time_us=received.time_us - round(value("EKF2_EV_DELAY") * 1e3),
        attitude=_valid(received.attitude) if use & _Use.YAW else None,
        position_variance_m2=_variance(
            received.position_variance_m2 if of_message else NAN3, value("EKF2_EVP_NOISE")
        ),
        attitude_variance_rad2=_variance(
            received.attitude_variance_rad2 if of_message else NAN3, value("EKF2_EVA_NOISE")
        ),
    )


def _valid(attitude: Quaternion | None) -> Quaternion | None:
    """A quaternion of unit length, or None."""
    if attitude is None:
        return None
    norm = hypot(*attitude)
    return normalized(attitude) if abs(norm - 1.0) <= _NORM_TOLERANCE else None  # false for NaN too


def _variance(given: Vec3, sigma: float) -> Vec3:
    """The variances given, but none below that of the parameter, which stands for unknown ones."""
    least = sigma * sigma
    if not all(map(isfinite, given)):
        return (least, least, least)
    return (max(least, given[0]), max(least, given[1]), max(least, given[2]))


def _diagonal(covariance: Sequence[float]) -> tuple[Vec3, Vec3]:
    """Variances of position and attitude, from the upper triangle of a matrix of six rows."""
    return (covariance[0], covariance[6], covariance[11]), (covariance[15], covariance[18], covariance[20])


def _position_ned_m(frame: int, x: float, y: float, z: float) -> Vec3:
    """As PX4: the frame's origin and heading become those of the local frame; NaN for an unknown frame."""
    if frame in (mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_LOCAL_FRD):
        return (x, y, z)
    if frame == mavlink.MAV_FRAME_LOCAL_ENU:
        return (y, x, -z)
    return (x, -y, -z) if frame == mavlink.MAV_FRAME_LOCAL_FLU else NAN3


def pose_of_odometry(message: Message, time_us: int) -> ExternalPose:
    """What an ODOMETRY of a kind that is used says, true at a vehicle time."""
    position, attitude = _diagonal(message.pose_covariance)
    if message.estimator_type == _NAIVE:
        position = attitude = NAN3
    elif message.frame_id == mavlink.MAV_FRAME_LOCAL_ENU:
        position = (position[1], position[0], position[2])
    w, x, y, z = message.q
    place = _position_ned_m(message.frame_id, message.x, message.y, message.z)
    return ExternalPose(time_us, place, (w, x, y, z), None, position, attitude, NAN3, message.reset_counter)


class ExternalPoseService(AutopilotService):
    """Passes poses of motion capture and visual odometry to the estimator."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange, clocks: Clocks) -> None:
        super().__init__(autopilot, exchange)
        self._clocks = clocks
        self._refused_us = -_REPEAT_TEXT_US
        self.handlers = {
            mavlink.MAVLINK_MSG_ID_ODOMETRY: self._odometry,
            mavlink.MAVLINK_MSG_ID_VISION_POSITION_ESTIMATE: self._vision_position_estimate,
            mavlink.MAVLINK_MSG_ID_ATT_POS_MOCAP: lambda _link, _message: None,
        }

    def _odometry(self, link: Link, message: Message) -> None:
        kind = message.estimator_type
        if kind not in _TAKEN:
            if kind != _UNUSED:
                self._refuse(f"ODOMETRY: estimator_type {kind} unsupported")
            return
        pose = pose_of_odometry(message, self._vehicle_time_us(link, message.time_usec))
        self._use(pose, message.quality)

    def _vision_position_estimate(self, link: Link, message: Message) -> None:
        position, attitude = _diagonal(message.covariance)
        angles_rad = (message.roll, message.pitch, message.yaw)
        turned = quaternion_from_euler(*angles_rad) if all(map(isfinite, angles_rad)) else None
        place = (message.x, message.y, message.z)
        time_us, resets = self._vehicle_time_us(link, message.usec), message.reset_counter
        self._use(ExternalPose(time_us, place, turned, None, position, attitude, NAN3, resets), quality=0)

    def _vehicle_time_us(self, link: Link, stamp_us: int) -> int:
        now_us = self._exchange.time_us
        return min(now_us, self._clocks.on(link.profile.name).vehicle_time_us(stamp_us, now_us))

    def _use(self, received: ExternalPose, quality: int) -> None:
        pose = usable_pose(received, quality, self._autopilot.parameters)
        if pose is not None:
            self._autopilot.estimator.take_external_pose(pose)

    def _refuse(self, text: str) -> None:
        now_us = self._exchange.time_us
        if now_us - self._refused_us >= _REPEAT_TEXT_US:
            self._refused_us = now_us
            self._autopilot.say(mavlink.MAV_SEVERITY_CRITICAL, text)
