"""Telemetry of sensors. There are no noisy sensors yet: pressure and magnetic field follow from the state."""

from __future__ import annotations

from math import atan2, degrees, hypot

from firmware_py.mavlink.dialect import Message, mavlink
from firmware_py.mavlink.port import AutopilotPort
from firmware_py.mavlink.scaling import boot_ms, degrees_e7, millimetres, whole
from firmware_py.types import Quaternion, Vec3

# North, east, down at PX4's simulated home (Zurich), gauss; World Magnetic Model 2025, two digits.
EARTH_FIELD_NED_GAUSS: Vec3 = (0.22, 0.013, 0.43)
_SEA_LEVEL_HPA = 1013.25
_SEA_LEVEL_K = 288.15
_LAPSE_K_M = 0.0065
_EXPONENT = 5.25588  # g M / (R L)
_IMU_FIELDS = 0b1_1011_1111_1111  # all but differential pressure


def temperature_k(altitude_m: float) -> float:
    """Air temperature of the International Standard Atmosphere, below 11 km (ISO 2533)."""
    return _SEA_LEVEL_K - _LAPSE_K_M * min(max(altitude_m, -5000.0), 11000.0)


def pressure_hpa(altitude_m: float) -> float:
    """Static pressure of the International Standard Atmosphere, below 11 km: p0 (T / T0)^5.256 (ISO 2533)."""
    return float(_SEA_LEVEL_HPA * (temperature_k(altitude_m) / _SEA_LEVEL_K) ** _EXPONENT)


def to_body(vector_ned: Vec3, attitude: Quaternion) -> Vec3:
    """A world vector in body axes, by the inverse of the unit quaternion: v + 2w (v × q) + 2 q × (q × v)."""
    w, qx, qy, qz = attitude
    x, y, z = vector_ned
    tx, ty, tz = 2 * (y * qz - z * qy), 2 * (z * qx - x * qz), 2 * (x * qy - y * qx)
    return (
        x + w * tx + ty * qz - tz * qy,
        y + w * ty + tz * qx - tx * qz,
        z + w * tz + tx * qy - ty * qx,
    )


def highres_imu(autopilot: AutopilotPort, _time_us: int) -> Message:
    """HIGHRES_IMU."""
    state, place = autopilot.state, autopilot.global_position()
    altitude_m = place.altitude_m if place else 0.0
    return mavlink.MAVLink_highres_imu_message(
        state.time_us,
        *state.specific_force_frd_m_s2,
        *state.angular_rate_frd_rad_s,
        *to_body(EARTH_FIELD_NED_GAUSS, state.attitude),
        pressure_hpa(altitude_m),
        0.0,
        altitude_m,
        temperature_k(altitude_m) - 273.15,
        _IMU_FIELDS,
    )


def scaled_pressure(autopilot: AutopilotPort, _time_us: int) -> Message | None:
    """SCALED_PRESSURE."""
    place = autopilot.global_position()
    if place is None:
        return None
    return mavlink.MAVLink_scaled_pressure_message(
        boot_ms(autopilot.state.time_us),
        pressure_hpa(place.altitude_m),
        0.0,
        whole((temperature_k(place.altitude_m) - 273.15) * 100, 16),
    )


def gps_raw_int(autopilot: AutopilotPort, _time_us: int) -> Message:
    """GPS_RAW_INT: a 3D fix with PX4's simulated figures, or no fix yet."""
    state, place = autopilot.state, autopilot.global_position()
    if place is None:
        return mavlink.MAVLink_gps_raw_int_message(
            state.time_us, mavlink.GPS_FIX_TYPE_NO_FIX, 0, 0, 0, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF, 0
        )
    north_m_s, east_m_s, _ = state.velocity_ned_m_s
    altitude_mm = millimetres(place.altitude_m)
    return mavlink.MAVLink_gps_raw_int_message(
        state.time_us,
        mavlink.GPS_FIX_TYPE_3D_FIX,
        degrees_e7(place.latitude_deg),
        degrees_e7(place.longitude_deg),
        altitude_mm,
        70,
        110,
        whole(hypot(north_m_s, east_m_s) * 100, 16, signed=False),
        whole(degrees(atan2(east_m_s, north_m_s)) % 360 * 100, 16, signed=False) % 36000,
        10,
        altitude_mm,
        900,
        1780,
        400,
    )
