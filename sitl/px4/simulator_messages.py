"""Messages of PX4's simulator interface, MAVLink 2 over a TCP connection: sensors out, motor outputs in."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, degrees, hypot, isnan, nan, sqrt
from typing import Self

from framerunner.geometry.vectors import NAN3, ZERO3, Vec3
from framerunner.vehicle.atmosphere import pressure_altitude_m
from framerunner.vehicle.geodesy import GeodeticPoint, LocalProjection
from framerunner.vehicle.measurements import (
    ExternalPose,
    FlowSample,
    GpsSample,
    RangeSample,
    Readings,
    Sensors,
)
from framerunner.wire.dialect import Message, degrees_e7, mavlink, millimetres, whole
from framerunner.wire.framing import packed
from sitl.px4.transmitter import Channels
from sitl.sensors.specs import RangeFinderSpec

_ACCELEROMETER, _GYROSCOPE = 0b111, 0b111 << 3
_MAGNETOMETER = 0b111 << 6
_BAROMETER = 1 << 9 | 1 << 11 | 1 << 12  # absolute pressure, pressure altitude, temperature
_TRUTH_PERIOD_US = 20_000
RC_PERIOD_US = 20_000
_RC_FIELDS = 18
_NO_CHANNEL = 0xFFFF
_FULL_SIGNAL = 100
_STANDARD_GRAVITY_M_S2 = 9.80665
_NO_COVARIANCE = (nan,) * 21
SIMULATOR_SYSTEM_ID = 1
SIMULATOR_COMPONENT_ID = 200  # the component PX4's own simulators use
ARMED_FLAG = int(mavlink.MAV_MODE_FLAG_SAFETY_ARMED)


@dataclass(frozen=True, slots=True)
class ActuatorControls:
    """HIL_ACTUATOR_CONTROLS: what PX4 commands.

    Attributes:
        time_us: PX4's clock, that of the sensors it answers.
        controls: of its outputs, shape (16,); of motors 0..1, all zero while disarmed.
        armed: whether PX4 is armed.
    """

    time_us: int
    controls: tuple[float, ...]
    armed: bool

    @classmethod
    def of(cls, message: Message) -> Self | None:
        """The outputs that a message of PX4's has; None: it is another one."""
        if message.get_msgId() != mavlink.MAVLINK_MSG_ID_HIL_ACTUATOR_CONTROLS:
            return None
        return cls(message.time_usec, tuple(message.controls), bool(message.mode & ARMED_FLAG))


class SensorMessages:
    """Makes the messages of each control tick.

    PX4 stamps GPS, poses, ranges and flow with its clock on their arrival, so they are sent before the
    HIL_SENSOR that advances the clock: the same part of PX4 then takes them in the same step each time.
    The first message is a HIL_SENSOR, by which PX4 sets its clock.

    Args:
        range_finder: of the drone; None: it has none.
        origin: of the true positions.
    """

    def __init__(self, range_finder: RangeFinderSpec | None, origin: GeodeticPoint) -> None:
        self._range_finder = range_finder
        self._projection = LocalProjection(origin)
        self._sender = mavlink.MAVLink(
            None, srcSystem=SIMULATOR_SYSTEM_ID, srcComponent=SIMULATOR_COMPONENT_ID
        )
        self._acceleration = self._rates = ZERO3  # the last ones that were delivered
        self._started = False

    def pack(
        self, readings: Readings, pose: ExternalPose | None, true: Sensors, rc: Channels | None = None
    ) -> bytes:
        """All messages of a tick; the last one is its HIL_SENSOR.

        Args:
            readings: what the sensors deliver.
            pose: of motion capture, if one has arrived.
            true: the true state, for PX4's log.
            rc: what the receiver of the remote control delivers now; None: nothing.
        """
        messages: list[Message] = []
        sensor = self._imu_and_air(readings)
        if self._started:
            if pose is not None:
                messages.append(_odometry(pose))
            if readings.gps is not None:
                messages.append(_gps(readings.gps))
            if readings.range_finder is not None and self._range_finder is not None:
                messages.append(_distance(readings.range_finder, self._range_finder))
            if readings.optical_flow is not None:
                messages.append(_flow(readings.optical_flow))
            if readings.time_us % _TRUTH_PERIOD_US == 0:
                messages.append(self._truth(true))
            if rc is not None:
                messages.append(_channels(readings.time_us, rc))
        self._started = True
        return b"".join([packed(message, self._sender) for message in (*messages, sensor)])

    def _imu_and_air(self, readings: Readings) -> Message:
        """HIL_SENSOR; a sensor that delivers nothing is not flagged as updated, but PX4's clock advances."""
        flags = 0
        imu = readings.imu
        if imu is not None:
            if not isnan(imu.specific_force_frd_m_s2[0]):
                self._acceleration = imu.specific_force_frd_m_s2
                flags = _ACCELEROMETER
            if not isnan(imu.angular_rate_frd_rad_s[0]):
                self._rates = imu.angular_rate_frd_rad_s
                flags |= _GYROSCOPE
        acceleration, rates, field = self._acceleration, self._rates, ZERO3
        if readings.magnetometer is not None:
            field = readings.magnetometer.field_frd_gauss
            flags |= _MAGNETOMETER
        pressure_hpa = altitude_m = temperature_c = 0.0
        barometer = readings.barometer
        if barometer is not None and barometer.pressure_pa > 0.0:
            pressure_hpa = barometer.pressure_pa * 0.01
            altitude_m = pressure_altitude_m(barometer.pressure_pa)
            temperature_c = barometer.temperature_k - 273.15
            flags |= _BAROMETER
        return mavlink.MAVLink_hil_sensor_message(
            readings.time_us,
            *acceleration,
            *rates,
            *field,
            pressure_hpa,
            0.0,  # differential pressure
            altitude_m,
            temperature_c,
            flags,
        )

    def _truth(self, true: Sensors) -> Message:
        place = self._projection.to_geodetic(true.position_ned_m)
        speed = _unsigned(sqrt(sum(each * each for each in true.velocity_ned_m_s)) * 100)
        return mavlink.MAVLink_hil_state_quaternion_message(
            true.time_us,
            true.attitude,
            *true.angular_rate_frd_rad_s,
            degrees_e7(place.latitude_deg),
            degrees_e7(place.longitude_deg),
            millimetres(place.altitude_m),
            *[_signed(each * 100) for each in true.velocity_ned_m_s],
            speed,
            speed,
            *[_signed(each / _STANDARD_GRAVITY_M_S2 * 1000) for each in true.specific_force_frd_m_s2],
        )


def _gps(gps: GpsSample) -> Message:
    north, east, down = gps.velocity_ned_m_s
    course_deg = degrees(atan2(east, north)) % 360.0
    return mavlink.MAVLink_hil_gps_message(
        gps.time_us,
        int(gps.fix_type),
        degrees_e7(gps.latitude_deg),
        degrees_e7(gps.longitude_deg),
        millimetres(gps.altitude_m),
        _unsigned(gps.horizontal_accuracy_m * 100),
        _unsigned(gps.vertical_accuracy_m * 100),
        _unsigned(hypot(north, east) * 100),
        _signed(north * 100),
        _signed(east * 100),
        _signed(down * 100),
        min(_unsigned(course_deg * 100), 35999),
        gps.satellites,
    )


def _odometry(pose: ExternalPose) -> Message:
    return mavlink.MAVLink_odometry_message(
        pose.time_us,
        mavlink.MAV_FRAME_LOCAL_NED,
        mavlink.MAV_FRAME_LOCAL_NED,
        *pose.position_ned_m,
        pose.attitude or (nan,) * 4,
        *(pose.velocity_ned_m_s or NAN3),
        *NAN3,  # angular rates
        _covariance(pose.position_variance_m2, pose.attitude_variance_rad2),
        _covariance(pose.velocity_variance_m2_s2, NAN3),
        pose.reset_counter & 0xFF,
        mavlink.MAV_ESTIMATOR_TYPE_VISION,
        100,  # quality
    )


def _distance(sample: RangeSample, spec: RangeFinderSpec) -> Message:
    measured = not isnan(sample.distance_m)
    distance_m = sample.distance_m if measured else spec.max_distance_m
    return mavlink.MAVLink_distance_sensor_message(
        sample.time_us // 1000,
        _unsigned(spec.min_distance_m * 100),
        _unsigned(spec.max_distance_m * 100),
        _unsigned(distance_m * 100),
        mavlink.MAV_DISTANCE_SENSOR_LASER,
        0,  # sensor's id
        mavlink.MAV_SENSOR_ROTATION_PITCH_270,  # so no quaternion is needed
        min(round((spec.noise_m * 100) ** 2), 254),
        signal_quality=100 if measured else 1,
    )


def _flow(flow: FlowSample) -> Message:
    return mavlink.MAVLink_hil_optical_flow_message(
        flow.time_us,
        0,  # sensor's id
        flow.integration_us,
        *flow.flow_rad,
        *flow.gyro_rad,
        nan,  # angle about the third axis
        0,  # temperature
        flow.quality,
        0,  # time since the last distance
        -1.0,  # no distance
    )


def _channels(time_us: int, channels: Channels) -> Message:
    unused = (_NO_CHANNEL,) * (_RC_FIELDS - len(channels))
    return mavlink.MAVLink_rc_channels_message(
        time_us // 1000, len(channels), *channels, *unused, _FULL_SIGNAL
    )


def has_whole_imu(readings: Readings) -> bool:
    """Whether gyroscope and accelerometer both deliver numbers."""
    imu = readings.imu
    return imu is not None and not isnan(imu.specific_force_frd_m_s2[0] + imu.angular_rate_frd_rad_s[0])


def _covariance(position: Vec3, turn: Vec3) -> tuple[float, ...]:
    """Upper right triangle of a 6 x 6 matrix with these variances on its diagonal, row by row."""
    if isnan(position[0]):
        return _NO_COVARIANCE
    x, y, z = position
    roll, pitch, yaw = turn
    return (x, 0, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, 0, 0, roll, 0, 0, pitch, 0, yaw)


def _signed(value: float) -> int:
    return whole(value, 16)


def _unsigned(value: float) -> int:
    return whole(value, 16, signed=False)
