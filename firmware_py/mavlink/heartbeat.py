"""HEARTBEAT: who we are and how we are, and hearing ground stations."""

from __future__ import annotations

from firmware_py.mavlink.exchange import Exchange, Handler
from firmware_py.mavlink.links import Link
from firmware_py.mavlink.port import AutopilotPort
from firmware_py.status import FlightMode, VehicleStatus
from wire.dialect import Message, mavlink

_CUSTOM = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
_ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED


def base_mode(status: VehicleStatus) -> int:
    """HEARTBEAT.base_mode as PX4 sets it: 29 disarmed and 157 armed in auto modes, 17 and 145 in offboard."""
    return int(_CUSTOM | status.mode.value.flags | (_ARMED if status.armed else 0))


def system_status(status: VehicleStatus) -> int:
    """HEARTBEAT.system_status (MAV_STATE)."""
    if status.armed and status.mode is FlightMode.TERMINATION:
        return int(mavlink.MAV_STATE_FLIGHT_TERMINATION)
    if status.failsafe:
        return int(mavlink.MAV_STATE_CRITICAL)
    if status.armed:
        return int(mavlink.MAV_STATE_ACTIVE)
    return int(mavlink.MAV_STATE_STANDBY if status.ready else mavlink.MAV_STATE_UNINIT)


def heartbeat(autopilot: AutopilotPort, _time_us: int) -> Message:
    """HEARTBEAT."""
    status = autopilot.status
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_QUADROTOR,
        mavlink.MAV_AUTOPILOT_PX4,
        base_mode(status),
        status.mode.custom_mode,
        system_status(status),
        3,
    )


def _hear(exchange: Exchange, link: Link, message: Message) -> None:
    if message.type == mavlink.MAV_TYPE_GCS:
        link.gcs_heard = True
        exchange.autopilot.ground_station_heard()


HANDLERS: dict[int, Handler] = {mavlink.MAVLINK_MSG_ID_HEARTBEAT: _hear}
