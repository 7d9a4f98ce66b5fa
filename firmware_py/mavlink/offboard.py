"""Offboard setpoints (position, velocity, acceleration, attitude, rates, motors) and a target to follow.

The rules are in `firmware_py.offboard_requests`. Differences from PX4: the same refusal is reported once a
second at most, not with every packet; SET_ACTUATOR_CONTROL_TARGET, which PX4 1.17 has removed, is flown.
"""

from __future__ import annotations

from math import isfinite

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import AutopilotService
from firmware_py.offboard_requests import (
    LocalTarget,
    SetpointRefusal,
    TargetMask,
    setpoint_from_attitude,
    setpoint_from_controls,
    setpoint_from_target,
)
from firmware_py.setpoints import Setpoint
from framerunner.geometry.vectors import NAN3, Vec3
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.wire.dialect import Message, mavlink
from framerunner.wire.exchange import Exchange
from framerunner.wire.link import Link

_REPEAT_TEXT_US = 1_000_000
_IS_RELATIVE = {mavlink.MAV_FRAME_GLOBAL_INT: False, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: True}
_POSITION = TargetMask.X | TargetMask.Y | TargetMask.Z
_NO_ATTITUDE = mavlink.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE
_NO_RATES = (
    mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE
    | mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE
)
_NO_YAW_RATE = mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE
_NO_THRUST = mavlink.ATTITUDE_TARGET_TYPEMASK_THROTTLE_IGNORE
_FLIGHT_GROUP = 0  # of SET_ACTUATOR_CONTROL_TARGET: roll, pitch, yaw, thrust
_HAS_VELOCITY = 1 << 1  # est_capabilities of FOLLOW_TARGET


class OffboardService(AutopilotService):
    """Passes setpoints to the autopilot and reports refusals as texts."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        super().__init__(autopilot, exchange)
        self._refused_us: dict[str, int] = {}  # by text: one for each frame number and some more
        self.handlers = {
            mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED: self._local,
            mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT: self._global,
            mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET: self._attitude,
            mavlink.MAVLINK_MSG_ID_SET_ACTUATOR_CONTROL_TARGET: self._controls,
            mavlink.MAVLINK_MSG_ID_FOLLOW_TARGET: self._follow_target,
        }

    def _local(self, _link: Link, message: Message) -> None:
        if self._exchange.is_for_us(message, or_everyone=True):
            position = (message.x, message.y, message.z)
            self._take_target(message, message.coordinate_frame, position)

    def _global(self, _link: Link, message: Message) -> None:
        """As `_local`, with latitude, longitude and altitude; all of them or none, as in PX4.

        The frame is only that of the position.
        """
        if not self._exchange.is_for_us(message, or_everyone=True):
            return
        position: Vec3 | None = NAN3
        if not message.type_mask & _POSITION:
            relative = _IS_RELATIVE.get(message.coordinate_frame)
            if relative is None:
                text = f"{message.get_type()} invalid coordinate frame {message.coordinate_frame}"
                self._take(SetpointRefusal(text))
                return
            position = self._local_position(message, relative=relative)
        if position is not None:  # PX4 takes no setpoint relative to an unknown home either
            self._take_target(message, mavlink.MAV_FRAME_LOCAL_NED, position)

    def _attitude(self, _link: Link, message: Message) -> None:
        if not self._exchange.is_for_us(message, or_everyone=True):
            return
        mask = message.type_mask
        rates = None
        if not mask & _NO_RATES:
            yaw_rate_rad_s = 0.0 if mask & _NO_YAW_RATE else message.body_yaw_rate
            rates = (message.body_roll_rate, message.body_pitch_rate, yaw_rate_rad_s)
        w, x, y, z = message.q
        self._take(
            setpoint_from_attitude(
                None if mask & _NO_ATTITUDE else (w, x, y, z),
                rates,
                0.0 if mask & _NO_YAW_RATE else message.body_yaw_rate,
                0.0 if mask & _NO_THRUST else message.thrust,
                self._exchange.time_us,
            ),
        )

    def _controls(self, _link: Link, message: Message) -> None:
        if not self._exchange.is_for_us(message, or_everyone=True) or message.group_mlx != _FLIGHT_GROUP:
            return
        roll, pitch, yaw, thrust = message.controls[:4]
        setpoint = setpoint_from_controls(
            self._autopilot.airframe, (roll, pitch, yaw), thrust, self._exchange.time_us
        )
        self._take(setpoint)

    def _take(self, request: Setpoint | SetpointRefusal) -> None:
        if isinstance(request, Setpoint):
            self._autopilot.accept_setpoint(request)
            return
        refused_us = self._refused_us.get(request.text)
        if refused_us is None or self._exchange.time_us - refused_us >= _REPEAT_TEXT_US:
            self._refused_us[request.text] = self._exchange.time_us
            self._autopilot.say(mavlink.MAV_SEVERITY_CRITICAL, request.text)

    def _take_target(self, message: Message, frame: int, position_m: Vec3) -> None:
        target = LocalTarget(
            frame=frame,
            type_mask=message.type_mask,
            position_m=position_m,
            velocity_m_s=(message.vx, message.vy, message.vz),
            acceleration_m_s2=(message.afx, message.afy, message.afz),
            yaw_rad=message.yaw,
            yaw_rate_rad_s=message.yaw_rate,
            message=message.get_type(),
        )
        self._take(setpoint_from_target(target, self._autopilot.state, self._exchange.time_us))

    def _local_position(self, message: Message, *, relative: bool) -> Vec3 | None:
        """The position of a global target in the local frame; None when it is not known."""
        home = self._autopilot.status.home
        altitude_m = message.alt
        if relative:
            if home is None:
                return None
            altitude_m += home.altitude_m
        if not isfinite(altitude_m):
            return None
        return self._autopilot.local_position(
            GeodeticPoint(message.lat_int / 1e7, message.lon_int / 1e7, altitude_m)
        )

    def _follow_target(self, _link: Link, message: Message) -> None:
        """The target's position; one that is not on Earth, or not finite, is dropped."""
        position = self._autopilot.local_position(
            GeodeticPoint(message.lat / 1e7, message.lon / 1e7, message.alt)
        )
        if position is None:
            return
        north_m_s, east_m_s, down_m_s = (float(component) for component in message.vel)
        moves = message.est_capabilities & _HAS_VELOCITY and isfinite(north_m_s + east_m_s + down_m_s)
        velocity = (north_m_s, east_m_s, down_m_s) if moves else (0.0, 0.0, 0.0)
        self._autopilot.follow_target(position, velocity)
