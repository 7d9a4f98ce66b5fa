"""Remote identification, OPEN_DRONE_ID_...: the vehicle's serial number and position, and its operator's.

As in PX4, the operator's position is where the vehicle was armed; the serial number, which is that of
AUTOPILOT_VERSION, is sent on request.
"""

from __future__ import annotations

from math import atan2, degrees, hypot

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.service import AutopilotService
from firmware_py.status import LandedState, VehicleStatus
from framerunner.wire.dialect import BROADCAST, Message, degrees_e7, mavlink, whole
from framerunner.wire.exchange import Exchange
from framerunner.wire.vehicle_identity import simulator_uid

_NO_IDENTITY = [0] * 20
_UNKNOWN_M = -1000.0
_MAX_CM_S, _MAX_VERTICAL_CM_S = 25425, 6200  # of the standard; higher speeds are sent as these
_TIME_UNKNOWN = 65535.0
_HOUR_S = 3600.0
_EPOCH_2019_S = 1_546_300_800


class RemoteIdService(AutopilotService):
    """Sends the messages."""

    def __init__(self, autopilot: Autopilot, exchange: Exchange) -> None:
        super().__init__(autopilot, exchange)
        self.sources = {
            mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_BASIC_ID: self._basic_id,
            mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_LOCATION: self._location,
            mavlink.MAVLINK_MSG_ID_OPEN_DRONE_ID_SYSTEM: self._system,
        }

    def _basic_id(self) -> Message:
        """OPEN_DRONE_ID_BASIC_ID: the serial number in hexadecimal digits, as PX4 has it."""
        serial_number = f"{simulator_uid(self._exchange.system_id):016x}".encode()
        return mavlink.MAVLink_open_drone_id_basic_id_message(
            BROADCAST,
            BROADCAST,
            _NO_IDENTITY,
            mavlink.MAV_ODID_ID_TYPE_SERIAL_NUMBER,
            mavlink.MAV_ODID_UA_TYPE_HELICOPTER_OR_MULTIROTOR,
            [*serial_number.ljust(20, b"\0")],
        )

    def _location(self) -> Message | None:
        """OPEN_DRONE_ID_LOCATION, once there is a position; with the accuracies of GPS_RAW_INT."""
        autopilot = self._autopilot
        state, status, place = autopilot.state, autopilot.status, autopilot.global_position()
        if place is None:
            return None
        north_m_s, east_m_s, down_m_s = state.velocity_ned_m_s
        unix_us = self._exchange.unix_us
        return mavlink.MAVLink_open_drone_id_location_message(
            BROADCAST,
            BROADCAST,
            _NO_IDENTITY,
            _status(status),
            whole(degrees(atan2(east_m_s, north_m_s)) % 360.0, 16) % 360 * 100,
            min(whole(hypot(north_m_s, east_m_s) * 100, 16, signed=False), _MAX_CM_S),
            max(-_MAX_VERTICAL_CM_S, min(whole(-down_m_s * 100, 16), _MAX_VERTICAL_CM_S)),
            degrees_e7(place.latitude_deg),
            degrees_e7(place.longitude_deg),
            place.altitude_m,
            place.altitude_m,
            mavlink.MAV_ODID_HEIGHT_REF_OVER_TAKEOFF,
            place.altitude_m - status.home.altitude_m if status.home else _UNKNOWN_M,
            mavlink.MAV_ODID_HOR_ACC_1_METER,
            mavlink.MAV_ODID_VER_ACC_3_METER,
            mavlink.MAV_ODID_VER_ACC_UNKNOWN,
            mavlink.MAV_ODID_SPEED_ACC_1_METERS_PER_SECOND,
            unix_us * 1e-6 % _HOUR_S if unix_us else _TIME_UNKNOWN,
            mavlink.MAV_ODID_TIME_ACC_0_1_SECOND if unix_us else mavlink.MAV_ODID_TIME_ACC_UNKNOWN,
        )

    def _system(self) -> Message | None:
        """OPEN_DRONE_ID_SYSTEM, once there is a home."""
        home = self._autopilot.status.home
        if home is None:
            return None
        unix_us = self._exchange.unix_us
        return mavlink.MAVLink_open_drone_id_system_message(
            BROADCAST,
            BROADCAST,
            _NO_IDENTITY,
            mavlink.MAV_ODID_OPERATOR_LOCATION_TYPE_TAKEOFF,
            mavlink.MAV_ODID_CLASSIFICATION_TYPE_UNDECLARED,
            degrees_e7(home.latitude_deg),
            degrees_e7(home.longitude_deg),
            1,
            0,
            _UNKNOWN_M,
            _UNKNOWN_M,
            mavlink.MAV_ODID_CATEGORY_EU_UNDECLARED,
            mavlink.MAV_ODID_CLASS_EU_UNDECLARED,
            home.altitude_m,
            max(0, int(unix_us * 1e-6) - _EPOCH_2019_S) & 0xFFFFFFFF if unix_us else 0,
        )


def _status(status: VehicleStatus) -> int:
    if status.failsafe and status.armed:
        return int(mavlink.MAV_ODID_STATUS_EMERGENCY)
    if status.landed_state is LandedState.ON_GROUND:
        return int(mavlink.MAV_ODID_STATUS_GROUND)
    return int(mavlink.MAV_ODID_STATUS_AIRBORNE)
