"""Home and the local frame's origin: told, whenever they change too, and the origin set."""

from __future__ import annotations

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.scaling import degrees_e7, millimetres
from firmware_py.mavlink.service import Service
from firmware_py.types import GeodeticPoint
from wire.dialect import Message, mavlink
from wire.exchange import Exchange
from wire.link import Link


class PlaceService(Service):
    """HOME_POSITION, GPS_GLOBAL_ORIGIN and SET_GPS_GLOBAL_ORIGIN."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        self._autopilot = autopilot
        self._exchange = exchange
        self._origin: GeodeticPoint | None = None  # as last told
        self._home: GeodeticPoint | None = None
        self.handlers = {mavlink.MAVLINK_MSG_ID_SET_GPS_GLOBAL_ORIGIN: self._set_origin}
        self.sources = {
            mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: self._gps_global_origin,
            mavlink.MAVLINK_MSG_ID_HOME_POSITION: self._home_position,
        }

    def update(self) -> None:
        """Tell what has changed; nobody waits two seconds for home."""
        status = self._autopilot.status
        if status.origin is not self._origin:
            self._origin = status.origin
            self._broadcast(self._gps_global_origin())
        if status.home is not self._home:
            self._home = status.home
            self._broadcast(self._home_position())

    def _broadcast(self, message: Message | None) -> None:
        if message is not None:
            self._exchange.broadcast(message)

    def _home_position(self) -> Message | None:
        """HOME_POSITION, once there is one."""
        status = self._autopilot.status
        if status.home is None:
            return None
        return mavlink.MAVLink_home_position_message(
            degrees_e7(status.home.latitude_deg),
            degrees_e7(status.home.longitude_deg),
            millimetres(status.home.altitude_m),
            *status.home_ned_m,
            (1.0, 0.0, 0.0, 0.0),
            0.0,
            0.0,
            0.0,
            self._autopilot.state.time_us,
        )

    def _gps_global_origin(self) -> Message | None:
        """GPS_GLOBAL_ORIGIN, once there is one."""
        origin = self._autopilot.status.origin
        if origin is None:
            return None
        return mavlink.MAVLink_gps_global_origin_message(
            degrees_e7(origin.latitude_deg),
            degrees_e7(origin.longitude_deg),
            millimetres(origin.altitude_m),
            self._autopilot.state.time_us,
        )

    def _set_origin(self, _link: Link, message: Message) -> None:
        if message.target_system == self._exchange.system_id:
            self._autopilot.set_origin(
                GeodeticPoint(message.latitude / 1e7, message.longitude / 1e7, message.altitude / 1e3)
            )
