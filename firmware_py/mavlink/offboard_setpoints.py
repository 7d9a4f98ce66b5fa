"""Offboard setpoints: positions, velocities, accelerations, attitudes, rates, motors.

The rules are in `firmware_py.offboard_requests`. Differences from PX4: the same refusal is said once a
second at most, not with every packet; SET_ACTUATOR_CONTROL_TARGET, which PX4 1.17 no longer knows, is flown.
"""

from __future__ import annotations

from math import isfinite

from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.offboard_requests import (
    LocalTarget,
    SetpointRefusal,
    TargetMask,
    setpoint_from_attitude,
    setpoint_from_controls,
    setpoint_from_target,
)
from firmware_py.setpoints import Setpoint
from firmware_py.types import GeodeticPoint
from geometry.vectors import NAN3, Vec3
from wire.dialect import Message, mavlink

_SAY_AGAIN_US = 1_000_000
_ALTITUDES = {
    mavlink.MAV_FRAME_GLOBAL: False,
    mavlink.MAV_FRAME_GLOBAL_INT: False,
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT: True,
    mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT: True,
}
_PLACE = TargetMask.X | TargetMask.Y | TargetMask.Z
_NO_ATTITUDE = mavlink.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE
_NO_RATES = (
    mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE
    | mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE
)
_NO_YAW_RATE = mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE
_NO_THRUST = mavlink.ATTITUDE_TARGET_TYPEMASK_THROTTLE_IGNORE
_FLIGHT_GROUP = 0  # of SET_ACTUATOR_CONTROL_TARGET: roll, pitch, yaw, thrust


class SetpointService:
    """Takes setpoints to the autopilot, refusals to people.

    Attributes:
        handlers: by message id.
    """

    __slots__ = ("_said_us", "handlers")

    def __init__(self) -> None:
        self._said_us: dict[str, int] = {}  # one key for each frame number and some more: bounded
        self.handlers: dict[int, Handler] = {
            mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED: self._local,
            mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_GLOBAL_INT: self._global,
            mavlink.MAVLINK_MSG_ID_SET_ATTITUDE_TARGET: self._attitude,
            mavlink.MAVLINK_MSG_ID_SET_ACTUATOR_CONTROL_TARGET: self._controls,
        }

    def _local(self, exchange: Exchange, _link: Link, message: Message) -> None:
        if exchange.is_for_us(message, or_everyone=True):
            position = (message.x, message.y, message.z)
            self._take(exchange, _from_target(exchange, message, message.coordinate_frame, position))

    def _global(self, exchange: Exchange, _link: Link, message: Message) -> None:
        """As the local one, with the place on Earth; all of it or none, as in PX4."""
        if not exchange.is_for_us(message, or_everyone=True):
            return
        relative = _ALTITUDES.get(message.coordinate_frame)
        if relative is None:
            frame = message.coordinate_frame
            text = f"SET_POSITION_TARGET_GLOBAL_INT invalid coordinate frame {frame}"
            self._take(exchange, SetpointRefusal(text))
            return
        position: Vec3 | None = NAN3
        if not message.type_mask & _PLACE:
            position = _place(exchange, message, relative=relative)
        if position is not None:  # without a home no height above it: no setpoint, as in PX4
            self._take(exchange, _from_target(exchange, message, mavlink.MAV_FRAME_LOCAL_NED, position))

    def _attitude(self, exchange: Exchange, _link: Link, message: Message) -> None:
        if not exchange.is_for_us(message, or_everyone=True):
            return
        mask = message.type_mask
        rates = None
        if not mask & _NO_RATES:
            yaw_rate_rad_s = 0.0 if mask & _NO_YAW_RATE else message.body_yaw_rate
            rates = (message.body_roll_rate, message.body_pitch_rate, yaw_rate_rad_s)
        w, x, y, z = message.q
        self._take(
            exchange,
            setpoint_from_attitude(
                None if mask & _NO_ATTITUDE else (w, x, y, z),
                rates,
                0.0 if mask & _NO_YAW_RATE else message.body_yaw_rate,
                0.0 if mask & _NO_THRUST else message.thrust,
                exchange.time_us,
            ),
        )

    def _controls(self, exchange: Exchange, _link: Link, message: Message) -> None:
        if not exchange.is_for_us(message, or_everyone=True) or message.group_mlx != _FLIGHT_GROUP:
            return
        roll, pitch, yaw, thrust = message.controls[:4]
        setpoint = setpoint_from_controls(
            exchange.autopilot.airframe, (roll, pitch, yaw), thrust, exchange.time_us
        )
        self._take(exchange, setpoint)

    def _take(self, exchange: Exchange, request: Setpoint | SetpointRefusal) -> None:
        if isinstance(request, Setpoint):
            exchange.autopilot.accept_setpoint(request)
            return
        said_us = self._said_us.get(request.text)
        if said_us is None or exchange.time_us - said_us >= _SAY_AGAIN_US:
            self._said_us[request.text] = exchange.time_us
            exchange.autopilot.say(mavlink.MAV_SEVERITY_CRITICAL, request.text)


def _from_target(
    exchange: Exchange, message: Message, frame: int, position_m: Vec3
) -> Setpoint | SetpointRefusal:
    target = LocalTarget(
        frame=frame,
        type_mask=message.type_mask,
        position_m=position_m,
        velocity_m_s=(message.vx, message.vy, message.vz),
        acceleration_m_s2=(message.afx, message.afy, message.afz),
        yaw_rad=message.yaw,
        yaw_rate_rad_s=message.yaw_rate,
    )
    return setpoint_from_target(target, exchange.autopilot.state, exchange.time_us)


def _place(exchange: Exchange, message: Message, *, relative: bool) -> Vec3 | None:
    """The place of a global target in the local frame; None when it cannot be known."""
    home = exchange.autopilot.status.home
    altitude_m = message.alt
    if relative:
        if home is None:
            return None
        altitude_m += home.altitude_m
    if not isfinite(altitude_m):
        return None
    return exchange.autopilot.local_position(
        GeodeticPoint(message.lat_int / 1e7, message.lon_int / 1e7, altitude_m)
    )
