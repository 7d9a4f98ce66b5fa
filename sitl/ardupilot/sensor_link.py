"""The sensors that ArduPilot takes over MAVLink: the simulated motion capture and optical flow.

ArduPilot's JSON interface has no field for them, so they take a serial port of its own, as in a hall. Poses
are VISION_POSITION_ESTIMATE: its ODOMETRY must have a velocity, which motion capture does not measure.
Without GPS its estimator has no origin until somebody sets it, so that is done here, too.

Flow is OPTICAL_FLOW. `AP_OpticalFlow_MAV.cpp` of ArduPilot 4.7 reads its whole numbers `flow_x` and `flow_y`,
and takes for the rate in rad/s their product with the seconds since the message before and the parameters'
scale. Its estimator takes a message for the mean of a tenth of a second (`flowTimeDeltaAvg_ms`).
"""

from __future__ import annotations

from collections.abc import Callable

from framerunner.geometry.rotations import euler_from_quaternion
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import ExternalPose, FlowSample
from framerunner.wire.dialect import Message, degrees_e7, mavlink, millimetres
from framerunner.wire.framing import packed
from framerunner.wire.transports.sockets import bind_udp
from sitl.ardupilot.sole_sender import mavlink_sender

SENSOR_PORT = 9006
"""UDP port of instance 0, between those of the JSON interface."""
_COMPONENT_ID = int(mavlink.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY)
_ORIGIN_PERIOD_US = 1_000_000
_MOST_FLOW, _MOST_QUALITY = 32767, 255
FLOW_PERIOD_US = 100_000
FLOW_SCALE = 0.2
"""The least that ArduPilot's parameters allow: a unit of a message's flow is so many rad/s by its seconds."""


class SensorLink:
    """Sends poses and flow to an ArduPilot that sends to this port.

    Args:
        bind: address.
        port: UDP port.
        system_id: of the vehicle.
        origin: where on Earth the poses' frame is.
        notice: called with lines for people.

    Raises:
        LinkError: the port is in use.
    """

    def __init__(
        self, bind: str, port: int, system_id: int, origin: GeodeticPoint, notice: Callable[[str], None]
    ) -> None:
        self._socket = bind_udp((bind, port), "choose another --instance")
        self._sender = mavlink_sender(port, system_id, notice)
        self._codec = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=_COMPONENT_ID)
        self._origin = mavlink.MAVLink_set_gps_global_origin_message(
            system_id,
            degrees_e7(origin.latitude_deg),
            degrees_e7(origin.longitude_deg),
            millimetres(origin.altitude_m),
        )
        self._origin_due_us = 0
        self._flow = FlowMean()

    def send_pose(self, pose: ExternalPose) -> None:
        """Send a pose."""
        self._send_origin(pose.time_us)
        attitude = (0.0, 0.0, 0.0) if pose.attitude is None else euler_from_quaternion(pose.attitude)
        variances = (*pose.position_variance_m2, *pose.attitude_variance_rad2)
        self._send(
            mavlink.MAVLink_vision_position_estimate_message(
                pose.time_us,
                *pose.position_ned_m,
                *attitude,
                _covariance(variances),
                pose.reset_counter & 0xFF,
            )
        )

    def send_flow(self, sample: FlowSample) -> None:
        """Send the mean of the samples of `FLOW_PERIOD_US` with the last one of them."""
        self._send_origin(sample.time_us)
        if (message := self._flow.add(sample)) is not None:
            self._send(message)

    def close(self) -> None:
        """Close the port."""
        self._socket.close()

    def _send_origin(self, time_us: int) -> None:
        """Send the origin once a second of a measurement's time; ArduPilot takes it once."""
        if not 0 <= self._origin_due_us - time_us <= _ORIGIN_PERIOD_US:
            self._origin_due_us = time_us + _ORIGIN_PERIOD_US
            self._find_ardupilot()
            self._send(self._origin)

    def _find_ardupilot(self) -> None:
        """Take its address from what has arrived."""
        self._sender.select(self._socket.read_all())

    def _send(self, message: Message) -> None:
        """Send a message to ArduPilot; lost before anything was received."""
        if self._sender.address is not None:
            self._socket.write(packed(message, self._codec), self._sender.address)


class FlowMean:
    """Makes OPTICAL_FLOW of samples that follow each other; what rounding leaves is added to the next one."""

    def __init__(self) -> None:
        self._flow_rad, self._integrated_us, self._quality = (0.0, 0.0), 0, _MOST_QUALITY
        self._left = (0.0, 0.0)  # of `flow_x` and `flow_y`

    def add(self, sample: FlowSample) -> Message | None:
        """Take a sample; the message, when `FLOW_PERIOD_US` have been integrated."""
        self._flow_rad = (self._flow_rad[0] + sample.flow_rad[0], self._flow_rad[1] + sample.flow_rad[1])
        self._integrated_us += sample.integration_us
        self._quality = min(self._quality, sample.quality)
        if self._integrated_us < FLOW_PERIOD_US:
            return None
        integrated_s = self._integrated_us * 1e-6
        unit_rad = FLOW_SCALE * integrated_s**2
        exact = [flow / unit_rad + left for flow, left in zip(self._flow_rad, self._left, strict=True)]
        x, y = (max(-_MOST_FLOW, min(round(value), _MOST_FLOW)) for value in exact)
        self._left = (exact[0] - x, exact[1] - y)
        quality = self._quality
        self._flow_rad, self._integrated_us, self._quality = (0.0, 0.0), 0, _MOST_QUALITY
        return mavlink.MAVLink_optical_flow_message(sample.time_us, 0, x, y, 0.0, 0.0, quality, -1.0)


def _covariance(variances: tuple[float, ...]) -> tuple[float, ...]:
    """Upper right triangle of a 6 x 6 matrix with these variances on its diagonal, row by row."""
    return tuple(variances[row] if column == row else 0.0 for row in range(6) for column in range(row, 6))
