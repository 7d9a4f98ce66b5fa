"""Telemetry of motors: pulses, outputs, speeds.

The speeds are those that were asked for; nothing measures them.
"""

from __future__ import annotations

from firmware_py.mavlink.port import AutopilotPort
from firmware_py.mavlink.scaling import whole
from firmware_py.types import MotorSpeeds
from wire.dialect import Message, mavlink

_PWM_DISARMED_US, _PWM_LOW_US, _PWM_SPAN_US = 900, 1000, 1000
_SERVOS = 16
_OUTPUTS = 32
_BATCH = 4  # motors in one ESC message
_RPM = 60.0 / 6.283185307179586  # of 1 rad/s
_TEMPERATURE_UNKNOWN = 0x7FFF


def servo_output_raw(autopilot: AutopilotPort, _time_us: int) -> Message:
    """SERVO_OUTPUT_RAW: motor speeds as pulses, 900 µs disarmed, 1000 to 2000 µs from rest to full speed."""
    pulses = _pulses(autopilot)
    return mavlink.MAVLink_servo_output_raw_message(
        autopilot.state.time_us & 0xFFFFFFFF, 0, *pulses, *[0] * (_SERVOS - len(pulses))
    )


def actuator_output_status(autopilot: AutopilotPort, _time_us: int) -> Message:
    """ACTUATOR_OUTPUT_STATUS: the same pulses."""
    pulses = [float(pulse) for pulse in _pulses(autopilot)]
    return mavlink.MAVLink_actuator_output_status_message(
        autopilot.state.time_us, len(pulses), pulses + [0.0] * (_OUTPUTS - len(pulses))
    )


def esc_status(autopilot: AutopilotPort, _time_us: int) -> Message:
    """ESC_STATUS of the first four motors; each is said to draw its share of the current."""
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


def esc_info(autopilot: AutopilotPort, time_us: int) -> Message:
    """ESC_INFO of the first four motors: all there, nothing wrong, temperatures unknown."""
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


def _speeds(autopilot: AutopilotPort) -> MotorSpeeds:
    speeds = autopilot.output.speeds_rad_s[:_BATCH]
    return speeds if autopilot.status.armed else (0.0,) * len(speeds)


def _pulses(autopilot: AutopilotPort) -> list[int]:
    speeds_rad_s = autopilot.output.speeds_rad_s[:_SERVOS]
    if not autopilot.status.armed:
        return [_PWM_DISARMED_US] * len(speeds_rad_s)
    scale = _PWM_SPAN_US / autopilot.airframe.motor.max_speed_rad_s
    return [whole(_PWM_LOW_US + scale * speed, 16, signed=False) for speed in speeds_rad_s]
