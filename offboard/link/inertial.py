"""The vehicle's IMU samples (HIGHRES_IMU), and how sure it is of its own estimate (ODOMETRY).

ArduPilot does not say how sure it is. When its SYS_STATUS names optical flow and neither GPS nor poses from
outside, its position can only drift, and `BY_FLOW` is assumed.

Samples count only if they come so often that they are means without gaps: PX4 sends one in four by itself, of
which no motion can be integrated.
"""

from __future__ import annotations

import contextlib
from collections import deque
from math import sqrt
from struct import Struct
from typing import Any

from mavsdk.asyncio import MavsdkError

from framerunner.geometry.axes import flip_vector
from framerunner.geometry.vectors import Vec3
from framerunner.wire.dialect import AUTOPILOT_COMPONENT_ID, Message, mavlink
from framerunner.wire.vehicle_telemetry import MessageOrder
from offboard.drone import SURE_OF_POSITION_M, ImuInterval, ReportedAccuracy
from offboard.link.direct import subscribe

RATE_HZ = 250.0  # requested; PX4 has 200 samples a second by itself
ACCURACY_HZ = 10.0
LONGEST_US = 12_000  # between two samples that are means without gaps; now and then one is lost
SAMPLES_KEPT = 1000  # until they are taken
MOST_M_S2, MOST_RAD_S = 1000.0, 100.0  # beyond what IMUs of drones can measure
BY_FLOW = ReportedAccuracy(1.0, 0.05, 0.05, 0.05, 0.1)
_FLOW = int(mavlink.MAV_SYS_STATUS_SENSOR_OPTICAL_FLOW)
_POSITIONS = int(mavlink.MAV_SYS_STATUS_SENSOR_GPS) | int(mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION)
_ON_WIRE = Struct("<7f")  # a message that was not sent has double precision
_X, _Y, _Z, _YAW = 0, 6, 11, 20  # of ODOMETRY's pose_covariance and velocity_covariance


class InertialFeed:
    """Collects samples on MAVSDK's thread.

    Attributes:
        accuracy: the newest; None before the first.
    """

    def __init__(self) -> None:
        self.accuracy: ReportedAccuracy | None = None
        self._order, self._odometry_order = MessageOrder(), MessageOrder()
        self._last_us: int | None = None
        self._usual_us = 0.0  # between two samples
        self._samples: deque[ImuInterval] = deque(maxlen=SAMPLES_KEPT)

    def subscribe(self, direct: Any, *, tells_accuracy: bool) -> None:  # noqa: ANN401 - MAVSDK is untyped
        """Subscribe to MAVSDK's synchronous plugin `mavlink_direct`."""
        subscribe(direct, "HIGHRES_IMU", self.take_imu)
        if tells_accuracy:
            subscribe(direct, "ODOMETRY", self.take_odometry)
        else:
            subscribe(direct, "SYS_STATUS", self.take_sensors)

    async def request(self, plugin: Any) -> None:  # noqa: ANN401
        """Request both, by MAVSDK's asyncio `telemetry`; a vehicle that refuses is flown as it reports.

        A vehicle that sends ODOMETRY already keeps its rate.
        """
        with contextlib.suppress(MavsdkError):
            await plugin.set_rate_imu(RATE_HZ)
        if self.accuracy is None:
            with contextlib.suppress(MavsdkError):
                await plugin.set_rate_odometry(ACCURACY_HZ)

    @property
    def drifts(self) -> bool:
        """The vehicle is not sure of its position, and sends what the app needs to estimate it."""
        accuracy = self.accuracy
        return accuracy is not None and accuracy.position_std_m > SURE_OF_POSITION_M and self._has_no_gaps

    @property
    def _has_no_gaps(self) -> bool:
        return 0.0 < self._usual_us <= LONGEST_US

    def take(self, until_us: int) -> tuple[ImuInterval, ...]:
        """The samples before a vehicle time since the last call, oldest first.

        One of that time may arrive before or after the message that made the tick.
        """
        samples, taken = self._samples, []
        while samples and samples[0].time_us < until_us:
            taken.append(samples.popleft())
        return tuple(taken) if self._has_no_gaps else ()

    def take_imu(self, message: Message) -> None:
        """Take a HIGHRES_IMU."""
        if message.get_srcComponent() != AUTOPILOT_COMPONENT_ID or not self._order.is_next(message.time_usec):
            return
        last_us, self._last_us = self._last_us, message.time_usec
        if last_us == message.time_usec:  # sent again by a vehicle whose time stands
            return
        force = (message.xacc, message.yacc, message.zacc)
        rate = (message.xgyro, message.ygyro, message.zgyro)
        if last_us is None or not (_is_within(force, MOST_M_S2) and _is_within(rate, MOST_RAD_S)):
            return
        period_us = message.time_usec - last_us
        usual_us = self._usual_us or period_us
        self._usual_us = usual_us + 0.1 * (min(period_us, 10 * LONGEST_US) - usual_us)
        self._samples.append(ImuInterval(message.time_usec, flip_vector(rate), flip_vector(force)))

    def take_odometry(self, message: Message) -> None:
        """Take an ODOMETRY."""
        is_autopilots = message.get_srcComponent() == AUTOPILOT_COMPONENT_ID
        if not is_autopilots or message.frame_id != mavlink.MAV_FRAME_LOCAL_NED:
            return
        if not self._odometry_order.is_next(message.time_usec):
            return
        self.accuracy = reported_accuracy(message) or self.accuracy

    def take_sensors(self, message: Message) -> None:
        """Take a SYS_STATUS of a vehicle that sends no accuracy."""
        if message.get_srcComponent() == AUTOPILOT_COMPONENT_ID:
            used = message.onboard_control_sensors_enabled
            self.accuracy = BY_FLOW if used & _FLOW and not used & _POSITIONS else None


def reported_accuracy(odometry: Message) -> ReportedAccuracy | None:
    """What an ODOMETRY tells of the errors and jumps of the vehicle's estimate; None if it does not."""
    pose, velocity = odometry.pose_covariance, odometry.velocity_covariance
    variances = (pose[_X], pose[_Y], pose[_Z], velocity[_X], velocity[_Y], velocity[_Z], pose[_YAW])
    if not all(variance >= 0.0 for variance in variances):  # NaN: not known
        return None
    x, y, z, vx, vy, vz, heading = map(sqrt, _ON_WIRE.unpack(_ON_WIRE.pack(*variances)))
    return ReportedAccuracy(max(x, y), z, max(vx, vy), vz, heading, odometry.reset_counter)


def _is_within(values: Vec3, most: float) -> bool:
    """Whether all are numbers of at most this size."""
    return all(abs(value) <= most for value in values)
