"""PX4's parameters for an airframe and a sensor suite of this simulator.

Values are for PX4 v1.14 to v1.17. Names and defaults are those of its parameter reference.
"""

from __future__ import annotations

from math import sqrt

from framerunner.errors import SettingError
from framerunner.vehicle.airframe import Airframe
from sitl.autopilots.parameters import Value
from sitl.px4.transmitter import CHANNELS
from sitl.sensors.specs import SuiteSpec

_INTEGRAL_SHARE = 4 / 3  # 1/s, of a rate controller's P, by PX4's defaults 0.15 and 0.2
_MAX_INTEGRAL_SHARE = 6.0  # for an airframe whose drag resists turning
_TURNING_RAD_S = 0.4  # rate for which that drag is sent ahead
_RATE_BANDWIDTH_RAD_S = 40.0  # of roll and pitch; D cancels the motors' lag, and filters leave 16 ms
_YAW_BANDWIDTH_RAD_S = 12.0
_YAW_INTEGRAL_SHARE = 0.5
_VELOCITY_CONTROL: dict[str, Value] = {
    "MC_AIRMODE": 1,  # a drone with little hover thrust has little torque otherwise
    "MC_ROLL_P": 10.0,
    "MC_PITCH_P": 10.0,
    "MPC_XY_VEL_P_ACC": 5.0,
    "MPC_XY_VEL_I_ACC": 1.0,
    "MPC_XY_VEL_D_ACC": 0.5,
    "MPC_Z_VEL_P_ACC": 12.0,
    "MPC_Z_VEL_I_ACC": 3.0,
    "MC_YAW_TQ_CUTOFF": 0.0,
}
"""For apps that command velocities; accelerations for velocities, so the same for all airframes.

With a high P the response is nearly the same with and without drag, which may grow with the square of the
speed. With a low I the rest takes several seconds, which the app tells from the lag; with a higher one the
drone is pushed aside after a fast leg, and with a low P it swings.
"""
RC_PARAMETERS: dict[str, Value] = {
    "COM_RC_IN_MODE": 6,  # a ground station's sticks while it sends some, otherwise the transmitter
    "RC_CHAN_CNT": CHANNELS,
    "RC_MAP_ROLL": 1,
    "RC_MAP_PITCH": 2,
    "RC_MAP_THROTTLE": 3,
    "RC_MAP_YAW": 4,
    "RC_MAP_FLTMODE": 5,
    "COM_FLTMODE1": 2,  # switch low: position
    "COM_FLTMODE4": 4,  # in the middle: hold
    "COM_FLTMODE6": 7,  # high: offboard
    "RC_MAP_KILL_SW": 6,
}
"""A transmitter's channels, in the usual order of sticks; PX4's default calibration is 1000, 1500, 2000."""
_MIN_THRUST_SHARE = 0.25  # of the hover thrust, in the air
_MAX_PX4_MIN_THRUST = 0.12  # PX4's default
_HORIZON_RESERVE_MS = 24  # with less, poses come too late for their time and the estimate lags by 20 ms
_MAX_GPS_DRIFT_M_S = 0.3  # on the ground
_ARRIVAL_EARLY_MS = 4  # a pose or fix is stamped with the clock of the tick before that of its arrival


_FLOW_ESTIMATOR: dict[str, Value] = {
    "EKF2_OF_CTRL": 1,
    "EKF2_RNG_CTRL": 1,  # flow is a velocity only with a distance to the ground
    "EKF2_HGT_REF": 0,  # over gates and a base a range is not the height
}
_NO_GPS: dict[str, Value] = {"SYS_HAS_GPS": 0, "EKF2_GPS_CTRL": 0}
_DRONES_WITH_POSES: dict[str, Value] = {
    **_NO_GPS,
    "EKF2_EV_CTRL": 15,  # position, height, velocity and yaw
    "EKF2_HGT_REF": 3,
    "EKF2_RNG_CTRL": 0,
    "SYS_HAS_MAG": 0,
    "EKF2_MAG_TYPE": 5,
    "EKF2_EV_DELAY": 0.0,
    "EKF2_EVP_NOISE": 0.01,
    "EKF2_EVV_NOISE": 0.02,
    "EKF2_EVA_NOISE": 0.02,
    "EKF2_DELAY_MAX": 20.0,
    "EKF2_ASP_DELAY": 20.0,
    "EKF2_GPS_DELAY": 20.0,
    "EKF2_OF_DELAY": 20.0,
    "EKF2_TAU_POS": 0.1,
    "EKF2_TAU_VEL": 0.1,
}
"""Of docs/real-drone.md: an estimate that follows motion capture closely."""


def drone_parameters(suite: SuiteSpec) -> dict[str, Value]:
    """What the estimator of a real drone with PX4 needs for the sensors that say where it is.

    Args:
        suite: with such sensors.

    Raises:
        SettingError: it has neither motion capture nor optical flow.
    """
    if suite.external_pose is not None:
        return dict(_DRONES_WITH_POSES)
    if suite.optical_flow is not None and suite.gps is None:
        return {**_NO_GPS, "EKF2_EV_CTRL": 0, **_FLOW_ESTIMATOR}
    raise SettingError(f"--sensors {suite.name}: a real drone indoors has mocap or flow")


def all_parameters(
    airframe: Airframe, suite: SuiteSpec, speed: float, *, transmitter: bool = False
) -> dict[str, Value]:
    """All parameters that differ from PX4's defaults for a drone; those of its airframe's file win.

    Args:
        airframe: of the drone.
        suite: its sensors, not ideal ones.
        speed: simulated seconds a second.
        transmitter: an operator has a remote control.
    """
    values = simulation_parameters(speed) | suite_parameters(suite) | airframe_parameters(airframe)
    return values | RC_PARAMETERS if transmitter else values


def airframe_parameters(airframe: Airframe) -> dict[str, Value]:
    """Geometry, motors and rate controllers of an airframe, and the parameters of its file.

    The rate controllers get the same bandwidth with each airframe: P is the bandwidth over the angular
    acceleration by an output of one. That follows from the airframe, as PX4's allocation scales a quadrotor's
    columns: to a norm of the square root of half the number of rotors for roll and pitch, to a maximum of
    one for yaw.
    """
    rotors, motor = airframe.rotors, airframe.motor
    values: dict[str, Value] = {
        "CA_AIRFRAME": 0,
        "CA_ROTOR_COUNT": len(rotors),
        "THR_MDL_FAC": 1.0,
        "BAT1_N_CELLS": airframe.battery.cells,
    }
    moment_m = motor.torque_nm_s2 / motor.thrust_n_s2
    for number, rotor in enumerate(rotors):
        forward_m, right_m, _ = rotor.position_frd_m
        values[f"CA_ROTOR{number}_PX"] = forward_m
        values[f"CA_ROTOR{number}_PY"] = right_m
        values[f"CA_ROTOR{number}_KM"] = rotor.yaw_sign * moment_m
        values[f"PWM_MAIN_FUNC{number + 1}"] = 101 + number
    hover = airframe.weight_n / airframe.full_thrust_n
    values["MPC_THR_HOVER"] = hover
    values["MPC_THR_MIN"] = min(_MAX_PX4_MIN_THRUST, _MIN_THRUST_SHARE * hover)
    values |= _rate_controllers(airframe) | _VELOCITY_CONTROL
    return values | {name: value for name, value in airframe.parameters.items() if name != "MPC_THR_HOVER"}


def _rate_controllers(airframe: Airframe) -> dict[str, Value]:
    rotors, motor, inertia = airframe.rotors, airframe.motor, airframe.inertia_kg_m2
    full_n = motor.thrust_n_s2 * motor.max_speed_rad_s**2
    share = sqrt(0.5)  # of each rotor's full thrust by an output of one, roll or pitch
    roll_nm = share * full_n * sum(abs(rotor.position_frd_m[1]) for rotor in rotors)
    pitch_nm = share * full_n * sum(abs(rotor.position_frd_m[0]) for rotor in rotors)
    yaw_nm = len(rotors) * motor.torque_nm_s2 * motor.max_speed_rad_s**2
    values: dict[str, Value] = {}
    for axis, moment_nm, about, drag_nm_s2 in (
        ("ROLL", roll_nm, inertia[0], airframe.drag.moment_nm_s2[0]),
        ("PITCH", pitch_nm, inertia[1], airframe.drag.moment_nm_s2[1]),
    ):
        gain = _RATE_BANDWIDTH_RAD_S * about / moment_nm
        damping_nm_s = drag_nm_s2 * _TURNING_RAD_S
        integral_share = min(max(_INTEGRAL_SHARE, damping_nm_s / about), _MAX_INTEGRAL_SHARE)
        values[f"MC_{axis}RATE_P"] = gain
        values[f"MC_{axis}RATE_I"] = integral_share * gain
        values[f"MC_{axis}RATE_D"] = motor.time_constant_s * gain
        values[f"MC_{axis}RATE_FF"] = damping_nm_s / moment_nm
    gain = _YAW_BANDWIDTH_RAD_S * inertia[2] / yaw_nm
    values["MC_YAWRATE_P"] = gain
    values["MC_YAWRATE_I"] = _YAW_INTEGRAL_SHARE * gain
    return values


def suite_parameters(suite: SuiteSpec) -> dict[str, Value]:
    """What PX4's estimator uses with a suite: its sensors, delays and noise."""
    values: dict[str, Value] = {
        "EKF2_RNG_CTRL": 0,  # over gates and a base a range is not the height
        "EKF2_MULTI_IMU": 0,
        "SENS_IMU_MODE": 1,  # one IMU, one estimator
        "EKF2_BARO_DELAY": 0,
    }
    if suite.magnetometer is None:
        values |= {"SYS_HAS_MAG": 0, "EKF2_MAG_TYPE": 5}
    if suite.gps is None:
        values |= {"SYS_HAS_GPS": 0, "EKF2_GPS_CTRL": 0, "EKF2_GPS_DELAY": 0}
    else:
        values["EKF2_GPS_DELAY"] = _delay_ms(suite.gps.delay_s)
        values["EKF2_REQ_HDRIFT"] = _MAX_GPS_DRIFT_M_S  # the noise of the suite's GPS passes 0.1 now and then
    pose = suite.external_pose
    if pose is not None:
        values |= {
            "EKF2_EV_CTRL": 11,  # position, height, yaw; motion capture measures no velocity
            "EKF2_HGT_REF": 3,
            "EKF2_EV_DELAY": _delay_ms(pose.delay_s),
            "EKF2_EVP_NOISE": 0.01,
            "EKF2_EVA_NOISE": 0.02,
            "EKF2_DELAY_MAX": max(20, _delay_ms(pose.delay_s) + _HORIZON_RESERVE_MS),
            "EKF2_ASP_DELAY": 20,
            "EKF2_OF_DELAY": 20,
            "EKF2_TAU_POS": 0.1,
            "EKF2_TAU_VEL": 0.1,
        }
    flow = suite.optical_flow
    if flow is not None and pose is None and suite.gps is None:
        values |= {
            "EKF2_OF_DELAY": 0,
            **_FLOW_ESTIMATOR,
            "SENS_FLOW_MINHGT": flow.min_distance_m,
            "SENS_FLOW_MAXHGT": flow.max_distance_m,
            "SENS_FLOW_MAXR": flow.max_flow_rad_s,
        }
    return values


def simulation_parameters(speed: float) -> dict[str, Value]:
    """What a simulated PX4 needs: our battery, and time-outs of links, which count wall time of the others.

    Args:
        speed: simulated seconds a second.
    """
    values: dict[str, Value] = {"NAV_RCL_ACT": 3, "NAV_DLL_ACT": 0, "SIM_BAT_ENABLE": 0}
    if speed > 1.0:
        values["COM_DL_LOSS_T"] = min(300, round(10 * speed))
    if speed > 4.0:
        values["COM_OF_LOSS_T"] = min(60.0, speed / 4)
    return values


def _delay_ms(delay_s: float) -> int:
    return max(0, round(delay_s * 1000) - _ARRIVAL_EARLY_MS)
