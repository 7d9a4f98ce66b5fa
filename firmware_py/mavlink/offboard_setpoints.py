"""SET_POSITION_TARGET_LOCAL_NED: offboard setpoints. The rules are in `firmware_py.setpoints`.

Difference from PX4: the same refusal is said once a second at most, not with every packet.
"""

from __future__ import annotations

from firmware_py.mavlink.dialect import Message, mavlink
from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.setpoints import LocalTarget, setpoint_from_target

_SAY_AGAIN_US = 1_000_000


class SetpointService:
    """Takes setpoints to the autopilot, refusals to people.

    Attributes:
        handlers: by message id.
    """

    __slots__ = ("_said_us", "handlers")

    def __init__(self) -> None:
        self._said_us: dict[str, int] = {}  # one key for each frame number and two more: bounded
        self.handlers: dict[int, Handler] = {
            mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED: self._receive
        }

    def _receive(self, exchange: Exchange, _link: Link, message: Message) -> None:
        if not exchange.is_for_us(message, or_everyone=True):
            return
        target = LocalTarget(
            frame=message.coordinate_frame,
            type_mask=message.type_mask,
            position_m=(message.x, message.y, message.z),
            velocity_m_s=(message.vx, message.vy, message.vz),
            acceleration_m_s2=(message.afx, message.afy, message.afz),
            yaw_rad=message.yaw,
            yaw_rate_rad_s=message.yaw_rate,
        )
        setpoint = setpoint_from_target(target, exchange.autopilot.state, exchange.time_us)
        if isinstance(setpoint, str):
            self._refuse(exchange, setpoint)
        else:
            exchange.autopilot.accept_setpoint(setpoint)

    def _refuse(self, exchange: Exchange, reason: str) -> None:
        said_us = self._said_us.get(reason)
        if said_us is None or exchange.time_us - said_us >= _SAY_AGAIN_US:
            self._said_us[reason] = exchange.time_us
            exchange.autopilot.say(mavlink.MAV_SEVERITY_CRITICAL, reason)
