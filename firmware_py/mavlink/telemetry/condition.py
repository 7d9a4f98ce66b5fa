"""Telemetry of the vehicle's condition: landed state, battery, mode, flight times, motors.

Difference from PX4: motor speeds are the commanded ones; they are not measured.
"""

from __future__ import annotations

from firmware_py.autopilot import Autopilot
from firmware_py.mavlink.telemetry.streams import AutopilotSource
from framerunner.vehicle.measurements import MotorSpeeds
from framerunner.wire.dialect import Message, boot_ms, mavlink, whole

_UNKNOWN_16 = 0xFFFF
_TEMPERATURE_UNKNOWN = 0x7FFF
_PWM_DISARMED_US, _PWM_LOW_US, _PWM_SPAN_US = 900.0, 1000.0, 1000.0
_SERVOS = 16
_OUTPUTS = 32
_BATCH = 4  # motors in one ESC message
_RPM = 60.0 / 6.283185307179586  # of 1 rad/s


def extended_sys_state(autopilot: Autopilot) -> Message:
    """EXTENDED_SYS_STATE."""
    return mavlink.MAVLink_extended_sys_state_message(
        mavlink.MAV_VTOL_STATE_UNDEFINED, int(autopilot.status.landed_state)
    )


def battery_status(autopilot: Autopilot) -> Message:
    """BATTERY_STATUS: one pack, with its whole voltage as the first cell's, as PX4 sends it."""
    battery = autopilot.battery
    return mavlink.MAVLink_battery_status_message(
        0,
        mavlink.MAV_BATTERY_FUNCTION_ALL,
        mavlink.MAV_BATTERY_TYPE_LIPO,
        _TEMPERATURE_UNKNOWN,
        [min(whole(battery.voltage_v * 1e3, 16, signed=False), _UNKNOWN_16 - 1)] + [_UNKNOWN_16] * 9,
        whole(battery.current_a * 100, 16),
        whole(battery.used_mah, 32),
        -1,
        min(100, whole(battery.remaining * 100, 8)),
        0,
        battery.warning,
    )


def current_mode(autopilot: Autopilot) -> Message:
    """CURRENT_MODE: the present mode and the requested one."""
    status, mode = autopilot.status, autopilot.status.mode
    return mavlink.MAVLink_current_mode_message(
        mode.value.standard, mode.custom_mode, status.intended_mode.custom_mode
    )


def flight_information(autopilot: Autopilot) -> Message:
    """FLIGHT_INFORMATION: when it was armed and took off, in vehicle time as in PX4; 0: it is not."""
    status, flight = autopilot.status, autopilot.flight
    flying = status.armed and flight.takeoff_us > flight.landed_us
    return mavlink.MAVLink_flight_information_message(
        boot_ms(autopilot.state.time_us),
        flight.armed_us if status.armed else 0,
        flight.takeoff_us if flying else 0,
        flight.number,
        boot_ms(flight.landed_us),
    )


def servo_output_raw(autopilot: Autopilot) -> Message:
    """SERVO_OUTPUT_RAW: motor speeds as pulses."""
    pulses = _whole_pulses_us(autopilot)
    return mavlink.MAVLink_servo_output_raw_message(
        autopilot.state.time_us & 0xFFFFFFFF, 0, *pulses, *[0] * (_SERVOS - len(pulses))
    )


def actuator_output_status(autopilot: Autopilot) -> Message:
    """ACTUATOR_OUTPUT_STATUS: the same pulses."""
    pulses = [float(pulse) for pulse in _whole_pulses_us(autopilot)]
    return mavlink.MAVLink_actuator_output_status_message(
        autopilot.state.time_us, len(pulses), pulses + [0.0] * (_OUTPUTS - len(pulses))
    )


def esc_status(autopilot: Autopilot) -> Message:
    """ESC_STATUS of the first four motors; each is reported to draw its share of the current."""
    speeds = _speeds(autopilot)
    motors = len(speeds)
    current_a = autopilot.battery.current_a / max(1, len(autopilot.airframe.rotors))
    rest = _BATCH - motors
    return mavlink.MAVLink_esc_status_message(
        0,
        autopilot.state.time_us,
        [whole(speed * _RPM, 32) for speed in speeds] + [0] * rest,
        [autopilot.battery.voltage_v] * motors + [0.0] * rest,
        [current_a] * motors + [0.0] * rest,
    )


def esc_info(autopilot: Autopilot, time_us: int) -> Message:
    """ESC_INFO of the first four motors: all present, no faults; its counter follows from vehicle time."""
    motors = len(autopilot.airframe.rotors)
    return mavlink.MAVLink_esc_info_message(
        0,
        autopilot.state.time_us,
        time_us // 100_000 & 0xFFFF,
        motors,
        mavlink.ESC_CONNECTION_TYPE_PPM,
        (1 << min(motors, 8)) - 1,
        [0] * _BATCH,
        [0] * _BATCH,
        [_TEMPERATURE_UNKNOWN] * _BATCH,
    )


def _speeds(autopilot: Autopilot) -> MotorSpeeds:
    speeds = autopilot.output.speeds_rad_s[:_BATCH]
    return speeds if autopilot.status.armed else (0.0,) * len(speeds)


def pulses_us(autopilot: Autopilot) -> list[float]:
    """Motor speeds as pulses, 900 µs disarmed, 1000 to 2000 µs from 0 to full speed."""
    speeds_rad_s = autopilot.output.speeds_rad_s[:_SERVOS]
    if not autopilot.status.armed:
        return [_PWM_DISARMED_US] * len(speeds_rad_s)
    scale = _PWM_SPAN_US / autopilot.airframe.motor.max_speed_rad_s
    return [_PWM_LOW_US + scale * speed for speed in speeds_rad_s]


def _whole_pulses_us(autopilot: Autopilot) -> list[int]:
    return [whole(pulse, 16, signed=False) for pulse in pulses_us(autopilot)]


CONDITION: dict[int, AutopilotSource] = {
    mavlink.MAVLINK_MSG_ID_ACTUATOR_OUTPUT_STATUS: actuator_output_status,
    mavlink.MAVLINK_MSG_ID_BATTERY_STATUS: battery_status,
    mavlink.MAVLINK_MSG_ID_CURRENT_MODE: current_mode,
    mavlink.MAVLINK_MSG_ID_ESC_STATUS: esc_status,
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: extended_sys_state,
    mavlink.MAVLINK_MSG_ID_FLIGHT_INFORMATION: flight_information,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: servo_output_raw,
}
