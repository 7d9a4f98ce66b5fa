"""A protocol fake of an ArduCopter that gets poses, in simulated time: what it takes, fuses and reports."""

from math import isfinite, sin

from pymavlink.dialects.v20 import ardupilotmega

from framerunner.geometry.rotations import euler_from_quaternion, multiply, quaternion_from_euler
from framerunner.wire.dialect import mavlink

TICK_US = 4000
RIGHT = {
    "AHRS_EKF_TYPE": 3,
    "EK3_SRC1_POSXY": 6,
    "EK3_SRC1_POSZ": 6,
    "EK3_SRC1_VELXY": 0,
    "EK3_SRC1_VELZ": 0,
    "EK3_SRC1_YAW": 6,
    "VISO_TYPE": 1,
    "VISO_DELAY_MS": 10,
    "VISO_POS_M_NSE": 0.02,
    "VISO_YAW_M_NSE": 0.05,
    "VISO_QUAL_MIN": 0,
    "VISO_SCALE": 1,
    "INS_GYRO_FILTER": 0,
}
_HEALTHY_US, _TIMEOUT_US = 300_000, 4_000_000
_PREARM, _VISION = 0x10000000, mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION


class FakeArduCopter:
    """Its position is the latest pose that it has taken; its gyroscope knows nothing of poses.

    Fields that a test may set: `parameters`, `turning` (it is turned by hand), `armed`, `origin`. Fields that
    a test may read: `poses`, the messages that it has taken; `origins`, how often one was sent to it.
    """

    def __init__(self, **parameters):
        self.parameters = RIGHT | parameters
        self.time_us = 0
        self.turning = self.armed = False
        self.origin = None
        self.poses, self.origins = [], 0
        self._taken_us = -_TIMEOUT_US
        self._position, self._yaw = (0.0, 0.0, 0.0), 0.0
        self._intervals_us = {}
        self._due_us = {}
        self._mav = mavlink.MAVLink(None, 1, 1)
        self._output = []

    def restart(self):
        """Start again, with the same parameters."""
        output = self._output
        turning = self.turning
        self.__init__(**self.parameters)
        self._output, self.turning = output, turning

    def attitude(self, time_us):
        """The true attitude at a time, body FRD to NED."""
        if not self.turning:
            return (1.0, 0.0, 0.0, 0.0)
        t = time_us / 1e6
        angles = (0.6 * sin(2.0 * t), 0.5 * sin(1.6 * t + 1.0), 0.8 * sin(1.2 * t + 2.0))
        return quaternion_from_euler(*angles)

    def position(self, time_us):
        """The true position at a time, NED metres."""
        return (0.3 * sin(time_us / 2e6), 0.0, -0.1) if self.turning else (0.0, 0.0, 0.0)

    def tick(self):
        """Go on by 4 ms."""
        self.time_us += TICK_US
        if self.time_us % 1_000_000 == 0:
            base = 81 | (128 if self.armed else 0)
            self._send(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_QUADROTOR, 3, base, 0, 3, 3))
        for number, interval_us in self._intervals_us.items():
            if self.time_us >= self._due_us.get(number, 0):
                self._due_us[number] = self.time_us + interval_us
                self._stream(number)

    def take_output(self):
        """The packets that it has sent since the last call."""
        output, self._output = self._output, []
        return output

    @property
    def _takes_poses(self):
        return self.time_us - self._taken_us < _HEALTHY_US

    @property
    def _has_position(self):
        return self.parameters["EK3_SRC1_POSXY"] == 6 and self.time_us - self._taken_us < _TIMEOUT_US

    def _send(self, message):
        self._output.append(message.pack(self._mav))

    def _stream(self, number):
        now_ms = self.time_us // 1000
        true = self.attitude(self.time_us)
        roll, pitch, yaw = euler_from_quaternion(true)
        if number == mavlink.MAVLINK_MSG_ID_ATTITUDE:
            w, x, y, z = self.attitude(self.time_us - TICK_US)
            _, *half = multiply((w, -x, -y, -z), true)
            rates = [2.0 * part / (TICK_US / 1e6) for part in half]
            yaw = self._yaw if self._has_position and self.parameters["EK3_SRC1_YAW"] == 6 else yaw
            self._send(mavlink.MAVLink_attitude_message(now_ms, roll, pitch, yaw, *rates))
        elif number == mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED and self._has_position:
            self._send(mavlink.MAVLink_local_position_ned_message(now_ms, *self._position, 0, 0, 0))
        elif number == mavlink.MAVLINK_MSG_ID_SYS_STATUS:
            vision = _VISION if self.parameters.get("VISO_TYPE") else 0
            health = _PREARM | (vision if self._takes_poses else 0)
            present = _PREARM | vision
            self._send(mavlink.MAVLink_sys_status_message(present, present, health, *[0] * 10))
        elif number == ardupilotmega.MAVLINK_MSG_ID_EKF_STATUS_REPORT:
            flags = 1 | 32 | (8 | 16 if self._has_position else 128)
            self._send(ardupilotmega.MAVLink_ekf_status_report_message(flags, 0.1, 0.1, 0.1, 0.0, 0.0, 0.0))
        elif number == mavlink.MAVLINK_MSG_ID_SIM_STATE:
            north_m, east_m, down_m = self.position(self.time_us)
            place = (-353_632_621 + round(north_m * 89.83), 1_491_652_374 + round(east_m * 110.1))
            degrees = (place[0] / 1e7, place[1] / 1e7, 584.0 - down_m)
            motion = (roll, pitch, yaw, *[0.0] * 6, *degrees, 0.0, 0.0, 0.0, 0.0, 0.0)
            self._send(mavlink.MAVLink_sim_state_message(*true, *motion, *place))

    def take(self, message):
        """Take a message, as ArduPilot's handlers do."""
        kind = message.get_type()
        if kind == "ODOMETRY":
            frames = (message.frame_id, message.child_frame_id)
            if frames == (mavlink.MAV_FRAME_LOCAL_FRD, mavlink.MAV_FRAME_BODY_FRD):
                assert all(isfinite(v) for v in (message.vx, message.vy, message.vz))  # it would fuse them
                self._take_pose(message, euler_from_quaternion(tuple(message.q))[2], message.quality)
        elif kind == "VISION_POSITION_ESTIMATE":
            self._take_pose(message, message.yaw, 0)
        elif kind == "TIMESYNC" and message.tc1 == 0:
            self._send(mavlink.MAVLink_timesync_message(self.time_us * 1000, message.ts1))
        elif kind == "PARAM_REQUEST_READ" and message.param_id in self.parameters:
            name, value = message.param_id, self.parameters[message.param_id]
            self._send(mavlink.MAVLink_param_value_message(name.encode(), value, 9, 1, 0))
        elif kind == "SET_GPS_GLOBAL_ORIGIN":
            self.origins += 1
            self.origin = self.origin or (message.latitude, message.longitude, message.altitude)
            self._tell_origin()
        elif kind == "COMMAND_LONG" and message.command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            self._intervals_us[int(message.param1)] = message.param2
        elif kind == "COMMAND_LONG" and message.command == mavlink.MAV_CMD_REQUEST_MESSAGE:
            assert message.param1 == mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN
            self._tell_origin()

    def _tell_origin(self):
        if self.origin is not None:
            self._send(mavlink.MAVLink_gps_global_origin_message(*self.origin))

    def _take_pose(self, message, yaw_rad, quality):
        if self.parameters.get("VISO_TYPE") == 1 and quality >= self.parameters["VISO_QUAL_MIN"]:
            self.poses.append(message)
            self._taken_us = self.time_us
            self._position, self._yaw = (message.x, message.y, message.z), yaw_rad
