"""The poses of the simulated motion capture as ArduPilot takes them: VISION_POSITION_ESTIMATE over MAVLink.

ArduPilot's JSON interface has no field for them, so they take a serial port of its own, as in a hall. Its
ODOMETRY must have a velocity, which motion capture does not measure. Without GPS its estimator has no origin
until somebody sets it, so that is done here, too.
"""

from __future__ import annotations

from collections.abc import Callable

from framerunner.geometry.rotations import euler_from_quaternion
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import ExternalPose
from framerunner.wire.dialect import Message, degrees_e7, mavlink, millimetres
from framerunner.wire.framing import packed
from framerunner.wire.transports.sockets import bind_udp
from sitl.ardupilot.sole_sender import mavlink_sender

POSE_PORT = 9006
"""UDP port of instance 0, between those of the JSON interface."""
_COMPONENT_ID = int(mavlink.MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY)
_ORIGIN_PERIOD_US = 1_000_000


class PoseLink:
    """Sends poses to an ArduPilot that sends to this port.

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

    def send(self, pose: ExternalPose) -> None:
        """Send a pose; once a second of its time the origin, which ArduPilot takes once."""
        if not 0 <= self._origin_due_us - pose.time_us <= _ORIGIN_PERIOD_US:
            self._origin_due_us = pose.time_us + _ORIGIN_PERIOD_US
            self._find_ardupilot()
            self._send(self._origin)
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

    def close(self) -> None:
        """Close the port."""
        self._socket.close()

    def _find_ardupilot(self) -> None:
        """Take its address from what has arrived."""
        self._sender.select(self._socket.read_all())

    def _send(self, message: Message) -> None:
        """Send a message to ArduPilot; lost before anything was received."""
        if self._sender.address is not None:
            self._socket.write(packed(message, self._codec), self._sender.address)


def _covariance(variances: tuple[float, ...]) -> tuple[float, ...]:
    """Upper right triangle of a 6 x 6 matrix with these variances on its diagonal, row by row."""
    return tuple(variances[row] if column == row else 0.0 for row in range(6) for column in range(row, 6))
