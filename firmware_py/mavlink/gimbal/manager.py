"""The gimbal's manager, in the autopilot (https://mavlink.io/en/services/gimbal_v2.html).

As PX4's, it takes orders of the component in primary or secondary control only, and of the mission. A region
of interest needs no control.
"""

from __future__ import annotations

from math import atan2, hypot, isfinite, isnan, nan, radians, remainder, tau

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.gimbal.device import CAPABILITIES, device_flags
from firmware_py.mavlink.gimbal.model import GIMBAL_COMPONENT_ID, GimbalDevice, GimbalTarget
from firmware_py.mavlink.service import AutopilotService, VehicleCommand
from firmware_py.missions.flight import SevenParams
from firmware_py.status import CommandResult
from framerunner.geometry.rotations import euler_from_quaternion, normalized, yaw_of
from framerunner.geometry.vectors import Vec3
from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, BROADCAST, Message, boot_ms, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

Controller = tuple[int, int]  # system and component id; zeros: nobody

_NOBODY: Controller = (0, 0)
_STATUS_US = 1_000_000
_REFUSAL_US = 5_000_000
_KEEP, _MYSELF, _RELEASE = -1, -2, -3  # of DO_GIMBAL_MANAGER_CONFIGURE
_YAW_LOCK = mavlink.GIMBAL_MANAGER_FLAGS_YAW_LOCK
_NEUTRAL = mavlink.GIMBAL_MANAGER_FLAGS_NEUTRAL
_RETRACT = mavlink.GIMBAL_MANAGER_FLAGS_RETRACT
_VEHICLE_FRAME = mavlink.GIMBAL_MANAGER_FLAGS_YAW_IN_VEHICLE_FRAME
_EARTH_FRAME = mavlink.GIMBAL_MANAGER_FLAGS_YAW_IN_EARTH_FRAME
_CAN_POINT_AT_PLACES = mavlink.GIMBAL_MANAGER_CAP_FLAGS_CAN_POINT_LOCATION_GLOBAL
_MIN_DISTANCE_M = 0.1  # nearer to a region the gimbal stays


class GimbalManager(AutopilotService):
    """Owns the gimbal: who controls it, and where it points."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange, gimbal: GimbalDevice) -> None:
        super().__init__(autopilot, exchange)
        self._gimbal = gimbal
        self._primary = self._secondary = _NOBODY
        self._region_ned_m: Vec3 | None = None
        self._status_due_us = 0
        self._refusal_due_us = 0
        self.commands = {
            mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: self._pitch_yaw,
            mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: self._configure,
        }
        own = (exchange.system_id, AUTOPILOT_COMPONENT_ID)
        self.mission_commands = {
            mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: self._turn,
            mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: lambda params: self._set_control(own, params),
            mavlink.MAV_CMD_DO_MOUNT_CONFIGURE: lambda _params: CommandResult.ACCEPTED,
            mavlink.MAV_CMD_DO_MOUNT_CONTROL: self._mount_control,
        }
        self.handlers = {
            mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_SET_ATTITUDE: self._set_attitude,
            mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_SET_PITCHYAW: self._set_pitch_yaw,
        }
        self.replies = {
            mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_INFORMATION: lambda _link, _index: [self._information()],
            mavlink.MAVLINK_MSG_ID_GIMBAL_MANAGER_STATUS: lambda _link, _index: [self._status()],
        }

    def update(self) -> None:
        """Follow the region of interest, and send GIMBAL_MANAGER_STATUS once a second."""
        if self._region_ned_m is not None:
            self._point_at(self._region_ned_m)
        if self._exchange.time_us >= self._status_due_us:
            self._send_status()

    def look_at(self, point_ned_m: Vec3 | None) -> None:
        """Point at a place in the vehicle's local frame and follow it; None: look ahead again."""
        if point_ned_m is None and self._region_ned_m is not None:
            self._gimbal.turn(GimbalTarget(0.0, 0.0))
        self._region_ned_m = point_ned_m

    def _pitch_yaw(self, command: VehicleCommand) -> CommandResult:
        if not self._is_in_control(command.sender):
            self._refuse(command.sender)
            return CommandResult.DENIED
        return self._turn(command.all_params)

    def _turn(self, params: SevenParams) -> CommandResult:
        """Params of DO_GIMBAL_MANAGER_PITCHYAW: degrees, degrees a second, flags, -, device."""
        pitch_deg, yaw_deg, pitch_rate_deg_s, yaw_rate_deg_s, flags, _, device = params
        if not self._is_ours(device) or not 0 <= flags < 1 << 16:
            return CommandResult.DENIED
        return self._point(
            int(flags),
            radians(pitch_deg),
            radians(yaw_deg),
            radians(pitch_rate_deg_s),
            radians(yaw_rate_deg_s),
        )

    def _mount_control(self, params: SevenParams) -> CommandResult:
        pitch_deg, _, yaw_deg = params[:3]
        return self._turn((pitch_deg, yaw_deg, nan, nan, 0.0, 0.0, 0.0))

    def _configure(self, command: VehicleCommand) -> CommandResult:
        return self._set_control(command.sender, command.all_params)

    def _set_control(self, sender: Controller, params: SevenParams) -> CommandResult:
        """Params of DO_GIMBAL_MANAGER_CONFIGURE: primary and secondary control, device.

        Ids below zero: -1 leaves it, -2 takes control for the sender, -3 releases the sender's control.
        """
        are_ids = all(isfinite(each) and -3 <= each <= 255 for each in params[:4])
        if not are_ids or not self._is_ours(params[6]):
            return CommandResult.DENIED
        system, component, second_system, second_component = (int(each) for each in params[:4])
        self._primary = _controller(self._primary, (system, component), sender)
        self._secondary = _controller(self._secondary, (second_system, second_component), sender)
        self._send_status()
        return CommandResult.ACCEPTED

    def _set_attitude(self, _link: Link, message: Message) -> None:
        """GIMBAL_MANAGER_SET_ATTITUDE: a quaternion, or NaN and angular velocities; roll is ignored."""
        if not self._is_order(message):
            return
        q = tuple(message.q)
        pitch_rad = yaw_rad = nan
        if all(map(isfinite, q)) and hypot(*q) > 0.1:
            _, pitch_rad, yaw_rad = euler_from_quaternion(normalized(q))
        self._point(message.flags, pitch_rad, yaw_rad, message.angular_velocity_y, message.angular_velocity_z)

    def _set_pitch_yaw(self, _link: Link, message: Message) -> None:
        if self._is_order(message):
            self._point(message.flags, message.pitch, message.yaw, message.pitch_rate, message.yaw_rate)

    def _point(
        self, flags: int, pitch_rad: float, yaw_rad: float, pitch_rate: float, yaw_rate: float
    ) -> CommandResult:
        """Turn the gimbal; it cannot be retracted."""
        numbers = (pitch_rad, yaw_rad, pitch_rate, yaw_rate)
        if flags & _RETRACT or not all(isnan(each) or isfinite(each) for each in numbers):
            return CommandResult.DENIED
        self._region_ned_m = None
        if flags & _NEUTRAL:
            self._gimbal.turn(GimbalTarget(0.0, 0.0))
            return CommandResult.ACCEPTED
        locked = bool(flags & _YAW_LOCK)
        to_north = bool(flags & _EARTH_FRAME) or (locked and not flags & _VEHICLE_FRAME)
        if to_north is not locked:
            heading_rad = yaw_of(self._autopilot.state.attitude)
            yaw_rad = remainder(yaw_rad + (heading_rad if locked else -heading_rad), tau)
        self._gimbal.turn(GimbalTarget(pitch_rad, yaw_rad, pitch_rate, yaw_rate, locked))
        return CommandResult.ACCEPTED

    def _point_at(self, region_ned_m: Vec3) -> None:
        north, east, down = (
            there - here
            for there, here in zip(region_ned_m, self._autopilot.state.position_ned_m, strict=True)
        )
        level_m = hypot(north, east)
        if hypot(level_m, down) > _MIN_DISTANCE_M:
            yaw_rad = atan2(east, north) if level_m > _MIN_DISTANCE_M else nan
            self._gimbal.turn(GimbalTarget(atan2(-down, level_m), yaw_rad, yaw_locked=True))

    def _is_order(self, message: Message) -> bool:
        sender = (message.get_srcSystem(), message.get_srcComponent())
        return (
            message.target_system in (BROADCAST, self._exchange.system_id)
            and message.target_component in (BROADCAST, AUTOPILOT_COMPONENT_ID)
            and self._is_ours(message.gimbal_device_id)
            and self._is_in_control(sender)
        )

    def _is_in_control(self, sender: Controller) -> bool:
        return sender != _NOBODY and sender in (self._primary, self._secondary)

    def _refuse(self, sender: Controller) -> None:
        """Say who is refused, once in `_REFUSAL_US`: orders may come many times a second."""
        if self._exchange.time_us < self._refusal_due_us:
            return
        self._refusal_due_us = self._exchange.time_us + _REFUSAL_US
        owner = "nobody" if self._primary == _NOBODY else f"{self._primary[0]}/{self._primary[1]}"
        text = f"Gimbal refused {sender[0]}/{sender[1]}: {owner} is in control"
        self._autopilot.say(mavlink.MAV_SEVERITY_WARNING, text)

    def _is_ours(self, device: float) -> bool:
        """Whether a device id is this gimbal's, or 0: of all; NaN, not given, means all."""
        return isnan(device) or device in (0, GIMBAL_COMPONENT_ID)

    def _send_status(self) -> None:
        time_us = self._exchange.time_us
        self._status_due_us = time_us - time_us % _STATUS_US + _STATUS_US
        self._exchange.broadcast(self._status())

    def _status(self) -> Message:
        time_ms = boot_ms(self._exchange.time_us)
        flags = device_flags(self._gimbal)
        return mavlink.MAVLink_gimbal_manager_status_message(
            time_ms, flags, GIMBAL_COMPONENT_ID, *self._primary, *self._secondary
        )

    def _information(self) -> Message:
        return mavlink.MAVLink_gimbal_manager_information_message(
            boot_ms(self._exchange.time_us),
            CAPABILITIES | _CAN_POINT_AT_PLACES,
            GIMBAL_COMPONENT_ID,
            0.0,
            0.0,
            *self._gimbal.limits.ranges_rad,
        )


def _controller(now: Controller, wanted: Controller, sender: Controller) -> Controller:
    """Who is in control after a request."""
    system, component = wanted
    if _KEEP in wanted:
        return now
    if _MYSELF in wanted:
        return sender
    if _RELEASE in wanted:
        return _NOBODY if now == sender else now
    return (system, component)
