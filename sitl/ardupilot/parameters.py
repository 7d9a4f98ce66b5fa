"""ArduCopter's parameters for an airframe of this simulator. Names are those of ArduCopter 4.7."""

from __future__ import annotations

from math import sqrt

from framerunner.errors import SettingError
from framerunner.vehicle.airframe import Airframe
from framerunner.wire.ardupilot_messages import EXTERNAL_NAVIGATION, POSE_ARRIVAL_EARLY_MS
from sitl.ardupilot.sensor_link import FLOW_PERIOD_US, FLOW_SCALE
from sitl.ardupilot.simulation import PULSE_MAX_US, PULSE_MIN_US, flies_by_flow
from sitl.autopilots.parameters import Value, text_of
from sitl.sensors.specs import SuiteSpec
from sitl.world import PHYSICS_RATE_HZ

_HOVER_SHARE = 0.25  # of full thrust, at least; ArduCopter's estimate of it has a lower limit of 0.125
_RATE_BANDWIDTH_RAD_S = 20.0  # of roll and pitch, with motors that are fast enough
_MOTOR_SHARE = 0.6  # of the motors' bandwidth that the rate controllers use at most
_DERIVATIVE_SHARE = 0.02
_SHARES_OF_BANDWIDTH = {  # each loop slower than the one inside it
    "ATC_ANG_RLL_P": 0.4,
    "ATC_ANG_PIT_P": 0.4,
    "PSC_VELXY_P": 0.2,
    "PSC_VELXY_I": 0.1,
    "PSC_VELXY_D": 0.015,
    "PSC_POSXY_P": 0.1,
    "PSC_VELZ_P": 0.4,
    "PSC_POSZ_P": 0.15,
}
_YAW_BANDWIDTH_RAD_S = 4.0
_YAW_INTEGRAL_SHARE = 0.1  # of P, by ArduCopter's defaults 0.18 and 0.018
_POSE_NOISE_M, _POSE_NOISE_RAD = 0.02, 0.05
_OPTICAL_FLOW = 5  # value of EK3_SRC1_VELXY
_LEAST_FLOW_NOISE_RAD_S = 0.1  # beside white noise there are errors of scale and of the distance
_MOST_FLOW_RAD_S = 4.0  # that the estimator's parameter allows
_FACTOR = 0.5  # of each motor in roll, pitch and yaw, as ArduCopter normalises them
_PLACES = ((1, 1), (-1, -1), (1, -1), (-1, 1))  # of rotors in X, as PX4 orders them: forward, right
_FRAMES = (  # FRAME_TYPE, how the rotors turn, ArduCopter's motors at their places
    (1, ("ccw", "ccw", "cw", "cw"), (1, 2, 3, 4)),
    (18, ("cw", "cw", "ccw", "ccw"), (2, 3, 4, 1)),
)


def all_parameters(airframe: Airframe, suite: SuiteSpec) -> dict[str, Value]:
    """All parameters that differ from ArduCopter's defaults.

    The rate controllers get the same bandwidth with each airframe: P is the bandwidth over the angular
    acceleration by an output of one. Motors that are much too strong for ArduCopter are limited by
    MOT_SPIN_MAX so that the drone hovers at a quarter of the thrust that remains.

    Raises:
        SettingError: the drone is no quadrotor in X.
    """
    values = simulation_parameters() | suite_parameters(suite)
    return values | airframe_parameters(airframe) | flight_parameters()


def simulation_parameters() -> dict[str, Value]:
    """What a simulated ArduCopter needs: no sticks, and a loop at half the rate of the simulation's steps.

    Its log is open before arming: else arming waits until a thread has opened it, in wall time.
    """
    return {
        "SCHED_LOOP_RATE": PHYSICS_RATE_HZ // 2,
        "SIM_RATE_HZ": PHYSICS_RATE_HZ,
        "FS_THR_ENABLE": 0,
        "SIM_BARO_RND": 0,
        "SIM_DRIFT_SPEED": 0,
        "BATT_MONITOR": 0,
        "FENCE_ENABLE": 0,
        "LOG_DISARMED": 1,
        **{
            f"INS_ACC{number}{what}_{axis}": value
            for number in ("", "2")
            for what, value in (("OFFS", 0.001), ("SCAL", 1.001))
            for axis in "XYZ"
        },
        **{
            f"COMPASS_OFS{number}_{axis}": value
            for number in ("", "2", "3")
            for axis, value in (("X", 5), ("Y", 13), ("Z", -18))
        },
    }


def suite_parameters(suite: SuiteSpec) -> dict[str, Value]:
    """What ArduPilot's estimator uses: poses of motion capture, optical flow, or its own simulated GPS."""
    if flies_by_flow(suite):
        return _flow_parameters(suite)
    pose = suite.external_pose
    if pose is None:
        return {
            "SIM_GPS1_ACC": 0.05,
            "SIM_GPS1_HZ": 10,
            "GPS1_RATE_MS": 100,
            "SIM_GPS1_LAG_MS": 100,
            "GPS1_DELAY_MS": 100,  # by default the estimator assumes 120 or 220: 2 to 12 cm at 1 m/s
        }
    return {
        "VISO_TYPE": 1,
        "VISO_DELAY_MS": max(0, round(pose.delay_s * 1000) - POSE_ARRIVAL_EARLY_MS),
        "VISO_POS_M_NSE": _POSE_NOISE_M,
        "VISO_YAW_M_NSE": _POSE_NOISE_RAD,
        "EK3_SRC1_POSXY": EXTERNAL_NAVIGATION,
        "EK3_SRC1_VELXY": 0,  # motion capture measures no velocity
        "EK3_SRC1_POSZ": EXTERNAL_NAVIGATION,
        "EK3_SRC1_VELZ": 0,
        "EK3_SRC1_YAW": EXTERNAL_NAVIGATION,
        "GPS1_TYPE": 0,
        "COMPASS_ENABLE": 0,
        "MAV3_OPTIONS": 2,  # poses are not forwarded to the other links
    }


def _flow_parameters(suite: SuiteSpec) -> dict[str, Value]:
    flow, range_finder = suite.optical_flow, suite.range_finder
    assert flow is not None, "it flies by it"
    values: dict[str, Value] = {
        "FLOW_TYPE": 5,  # MAVLink
        "FLOW_FXSCALER": round(1000 * (FLOW_SCALE - 1)),
        "FLOW_FYSCALER": round(1000 * (FLOW_SCALE - 1)),
        "EK3_FLOW_DELAY": 0,
        "EK3_FLOW_M_NSE": max(
            _LEAST_FLOW_NOISE_RAD_S, flow.noise_rad_s / sqrt(FLOW_PERIOD_US * 1e-6 * flow.rate_hz)
        ),
        "EK3_MAX_FLOW": min(_MOST_FLOW_RAD_S, flow.max_flow_rad_s),
        "EK3_ALT_M_NSE": 0.2,
        "INS_GYRO_FILTER": 80,
        "SIM_BARO_RND": 0.2,
        "EK3_SRC1_POSXY": 0,
        "EK3_SRC1_VELXY": _OPTICAL_FLOW,
        "EK3_SRC1_VELZ": 0,
        "GPS1_TYPE": 0,
        "MAV3_OPTIONS": 2,  # flow is not forwarded to the other links
    }
    if range_finder is not None:
        values |= {
            "RNGFND1_TYPE": 100,  # of the JSON interface
            "RNGFND1_ORIENT": 25,  # down
            "RNGFND1_MIN": range_finder.min_distance_m,
            "RNGFND1_MAX": range_finder.max_distance_m,
            "EK3_RNG_M_NSE": 0.01,  # a variance, m²; with 0.5 the ground beside a base counts after seconds
            "EK3_TERR_GRAD": 0.5,  # likewise
        }
    return values


def flight_parameters() -> dict[str, Value]:
    """How it flies in an arena of ten metres."""
    return {
        "GUID_TIMEOUT": 1,
        "DISARM_DELAY": 10,
        "LAND_SPEED": 30,
        "RTL_ALT": 200,
        "FS_GCS_ENABLE": 0,
        "ATC_INPUT_TC": 0.05,  # s; velocities are followed as soon as the loops can
        "PSC_JERK_XY": 20,  # m/s³
        "PSC_JERK_Z": 20,
        "PSC_VELXY_FLTE": 20,  # Hz
        "PSC_VELXY_FLTD": 20,
        "WPNAV_ACCEL": 500,  # cm/s²; in GUIDED, too
        "WPNAV_ACCEL_Z": 250,
        "WPNAV_SPEED_DN": 150,  # cm/s
    }


def airframe_parameters(airframe: Airframe) -> dict[str, Value]:
    """Frame, motors and controllers of an airframe.

    Raises:
        SettingError: it is no quadrotor in X.
    """
    motor, inertia = airframe.motor, airframe.inertia_kg_m2
    spin_max = min(1.0, sqrt(airframe.weight_n / airframe.full_thrust_n / _HOVER_SHARE))
    full_n = motor.thrust_n_s2 * (spin_max * motor.max_speed_rad_s) ** 2
    hover = airframe.weight_n / (full_n * len(airframe.rotors))
    values: dict[str, Value] = {
        "FRAME_CLASS": 1,
        **_frame(airframe),
        "MOT_PWM_MIN": PULSE_MIN_US,
        "MOT_PWM_MAX": PULSE_MAX_US,
        "MOT_THST_EXPO": 1.0,
        "MOT_SPIN_ARM": 0.02,
        "MOT_SPIN_MIN": 0.03,
        "MOT_SPIN_MAX": spin_max,
        "MOT_THST_HOVER": hover,
        "MOT_HOVER_LEARN": 0,
        "MOT_BAT_VOLT_MAX": 0,
        "PSC_ACCZ_P": 2 * hover,
        "PSC_ACCZ_I": 4 * hover,
    }
    fastest = _MOTOR_SHARE / motor.time_constant_s if motor.time_constant_s > 0.0 else _RATE_BANDWIDTH_RAD_S
    bandwidth = min(_RATE_BANDWIDTH_RAD_S, fastest)
    values |= {name: share * bandwidth for name, share in _SHARES_OF_BANDWIDTH.items()}
    for axis, index, arm in (("RLL", 0, 1), ("PIT", 1, 0)):
        moment_nm = _FACTOR * full_n * sum(abs(rotor.position_frd_m[arm]) for rotor in airframe.rotors)
        gain = bandwidth * inertia[index] / moment_nm
        values |= {
            f"ATC_RAT_{axis}_P": gain,
            f"ATC_RAT_{axis}_I": gain,
            f"ATC_RAT_{axis}_D": _DERIVATIVE_SHARE * gain,
        }
    yaw_nm = _FACTOR * len(airframe.rotors) * motor.torque_nm_s2 * (spin_max * motor.max_speed_rad_s) ** 2
    gain = min(_YAW_BANDWIDTH_RAD_S, fastest) * inertia[2] / yaw_nm
    return values | {"ATC_RAT_YAW_P": gain, "ATC_RAT_YAW_I": _YAW_INTEGRAL_SHARE * gain}


def _frame(airframe: Airframe) -> dict[str, Value]:
    """The type of frame, and the motor at each output, in the airframe's order."""
    rotors = airframe.rotors
    places = [(_sign(rotor.position_frd_m[0]), _sign(rotor.position_frd_m[1])) for rotor in rotors]
    if tuple(places) == _PLACES:
        spins = tuple(rotor.spin for rotor in rotors)
        for kind, turning, motors in _FRAMES:
            if spins == turning:
                functions = {f"SERVO{number}_FUNCTION": 32 + motor for number, motor in enumerate(motors, 1)}
                return {"FRAME_TYPE": kind, **functions}
    raise SettingError(
        f"airframe {airframe.name}: with ArduPilot it must be a quadrotor in X, rotors in the order front "
        "right, rear left, front left, rear right, those of a diagonal turning alike"
    )


def _sign(value: float) -> int:
    return 1 if value > 0.0 else -1


def file_of(parameters: dict[str, Value]) -> str:
    """A file of parameters as ArduPilot's `--defaults` takes it."""
    return "".join([f"{name} {text_of(value)}\n" for name, value in parameters.items()])
