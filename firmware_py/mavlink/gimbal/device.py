"""The gimbal device, component 154 (https://mavlink.io/en/services/gimbal_v2.html).

It reports its attitude and describes itself. It takes orders of its manager only, which is in the autopilot.
"""

from __future__ import annotations

from math import cos, sin

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.gimbal.model import GIMBAL_COMPONENT_ID, GimbalDevice
from firmware_py.mavlink.service import DeviceComponent
from firmware_py.mavlink.telemetry.connection import OWN_VERSION
from framerunner.geometry.rotations import quaternion_from_euler, yaw_of
from framerunner.wire.dialect import BROADCAST, Message, boot_ms, mavlink
from framerunner.wire.exchange import Exchange

_ATTITUDE_US = 100_000
_LEVEL = mavlink.GIMBAL_DEVICE_FLAGS_ROLL_LOCK | mavlink.GIMBAL_DEVICE_FLAGS_PITCH_LOCK
_IN_VEHICLE_FRAME = mavlink.GIMBAL_DEVICE_FLAGS_YAW_IN_VEHICLE_FRAME
CAPABILITIES = (  # the values are those of GIMBAL_MANAGER_CAP_FLAGS too
    mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_NEUTRAL
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_ROLL_LOCK
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_PITCH_AXIS
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_PITCH_LOCK
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_AXIS
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_FOLLOW
    | mavlink.GIMBAL_DEVICE_CAP_FLAGS_HAS_YAW_LOCK
)


def device_flags(gimbal: GimbalDevice) -> int:
    """GIMBAL_DEVICE_FLAGS and GIMBAL_MANAGER_FLAGS of a gimbal's present mode."""
    return int(_LEVEL | (mavlink.GIMBAL_DEVICE_FLAGS_YAW_LOCK if gimbal.yaw_locked else 0))


class GimbalComponent(DeviceComponent):
    """Answers for the gimbal device, sends its heartbeat and, at 10 Hz, its attitude."""

    component_id = GIMBAL_COMPONENT_ID
    kind = mavlink.MAV_TYPE_GIMBAL

    def __init__(self, autopilot: Autopilot, exchange: Exchange, gimbal: GimbalDevice) -> None:
        super().__init__(autopilot, exchange)
        self._gimbal = gimbal
        self._attitude_due_us = 0
        self._sent: Message | None = None  # the last attitude
        self.replies = {
            mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_INFORMATION: lambda _, __: [self._information()],
            mavlink.MAVLINK_MSG_ID_GIMBAL_DEVICE_ATTITUDE_STATUS: lambda _, __: [self._attitude()],
        }

    def update(self) -> None:
        """Send what is due."""
        time_us = self._exchange.time_us
        if time_us >= self._attitude_due_us:
            self._attitude_due_us = time_us - time_us % _ATTITUDE_US + _ATTITUDE_US
            self._sent = self._attitude()
            self._exchange.broadcast(self._sent, GIMBAL_COMPONENT_ID)
        super().update()

    def repeat(self) -> None:
        """Send the last attitude again."""
        if self._sent is not None:
            self._exchange.broadcast(self._sent, GIMBAL_COMPONENT_ID)

    def _attitude(self) -> Message:
        """GIMBAL_DEVICE_ATTITUDE_STATUS: yaw to the vehicle's heading, which `delta_yaw` gives, to north."""
        gimbal = self._gimbal
        pitch_rad, yaw_rate_rad_s = gimbal.pitch_rad, gimbal.yaw_rate_rad_s
        return mavlink.MAVLink_gimbal_device_attitude_status_message(
            BROADCAST,
            BROADCAST,
            boot_ms(self._exchange.time_us),
            device_flags(gimbal) | _IN_VEHICLE_FRAME,
            quaternion_from_euler(0.0, pitch_rad, gimbal.yaw_rad),
            -yaw_rate_rad_s * sin(pitch_rad),
            gimbal.pitch_rate_rad_s,
            yaw_rate_rad_s * cos(pitch_rad),
            0,
            yaw_of(self._autopilot.state.attitude),
            0.0,
            0,  # the sender's component
        )

    def _information(self) -> Message:
        major, minor, patch = OWN_VERSION
        return mavlink.MAVLink_gimbal_device_information_message(
            boot_ms(self._exchange.time_us),
            b"framerunner",
            b"simulated gimbal",
            b"",
            major | minor << 8 | patch << 16,
            0,
            0,
            CAPABILITIES,
            0,
            0.0,
            0.0,
            *self._gimbal.limits.ranges_rad,
        )
