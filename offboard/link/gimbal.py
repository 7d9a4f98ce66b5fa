"""The attitude of the gimbal that carries the camera, as telemetry reports it."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from framerunner.geometry.rotations import multiply, normalized, quaternion_from_yaw
from framerunner.geometry.vectors import Quaternion
from framerunner.wire.dialect import Message

_YAW_LOCK, _YAW_IN_VEHICLE_FRAME, _YAW_IN_EARTH_FRAME = 16, 32, 64  # GIMBAL_DEVICE_FLAGS
_MIN_LENGTH = 0.5  # of a quaternion that is one


@dataclass(frozen=True, slots=True)
class GimbalAttitude:
    """What the last GIMBAL_DEVICE_ATTITUDE_STATUS says."""

    attitude: Quaternion  # of the camera, forward-right-down; roll and pitch to the horizon
    to_north: bool  # its yaw is to north; else to the vehicle's heading

    def ned(self, yaw_ned_rad: float) -> Quaternion:
        """The camera's attitude, forward-right-down to NED, when the vehicle has a heading."""
        return self.attitude if self.to_north else multiply(quaternion_from_yaw(yaw_ned_rad), self.attitude)


def gimbal_attitude(message: Message) -> GimbalAttitude | None:
    """The attitude that a GIMBAL_DEVICE_ATTITUDE_STATUS says; None if it says none."""
    q, flags = message.q, message.flags
    if len(q) != 4 or not all(map(isfinite, q)) or sum(each * each for each in q) < _MIN_LENGTH:
        return None
    locked = bool(flags & _YAW_LOCK)  # older gimbals say the frame by this alone
    to_north = bool(flags & _YAW_IN_EARTH_FRAME) or (locked and not flags & _YAW_IN_VEHICLE_FRAME)
    w, x, y, z = q
    return GimbalAttitude(normalized((w, x, y, z)), to_north)
