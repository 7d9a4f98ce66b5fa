"""A small PX4 look-alike on a UDP socket: it moves as its setpoints say and keeps what it was told."""

from __future__ import annotations

import math
import socket
import threading
import time

from pymavlink.dialects.v20 import common as mavlink

OFFBOARD, AUTO, POSCTL = 6, 4, 3
LOITER, LAND = 3, 6
STEP_S = 0.01
ACCEPTED, REJECTED, UNSUPPORTED = 0, 1, 3


class UdpVehicle(threading.Thread):
    """Flies on a thread of its own. Fields without an underscore may be set by a test at any time."""

    def __init__(self, port: int, *, speed: float = 1.0, north_east_down=(0.0, 0.0, 0.0), yaw: float = 0.0):
        super().__init__(daemon=True)
        self.port = port
        self.speed = speed
        self.position = list(north_east_down)
        self.yaw = yaw
        self.armed = False
        self.mode = (AUTO, LOITER)
        self.armable = True
        self.armable_modes: set[int] = set()  # main modes; empty: any
        self.setpoint_loss_s = 1.0
        self.drift_m_s = 0.0  # downwards, in offboard
        self.refuse_arming = ""
        self.ignore_modes = False
        self.mute = False
        self.heartbeats = True
        self.tells_disarmed = False  # in heartbeats, armed or not
        self.deaf_s = 0.0  # vehicle time until which commands are lost
        self.swap = False  # ten times a second an attitude comes after the next one
        self.setpoints: list[tuple[float, float, float, float, float]] = []  # wall time, vx, vy, vz, yaw rate
        self.commands: list[tuple[int, float, float]] = []
        self.time_s = 100.0
        self._velocity = [0.0, 0.0, 0.0]
        self._yaw_rate = 0.0
        self._last_setpoint_s = -math.inf
        self._halt = threading.Event()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self._mav = mavlink.MAVLink(self, srcSystem=1, srcComponent=1)
        self._parser = mavlink.MAVLink(None)
        self._parser.robust_parsing = True

    def write(self, data: bytes) -> None:
        self._socket.sendto(data, ("127.0.0.1", self.port))

    def stop(self) -> None:
        self._halt.set()
        self.join()
        self._socket.close()

    def run(self) -> None:
        next_s = time.monotonic()
        step = 0
        while not self._halt.is_set():
            self._read()
            self.time_s += STEP_S
            step += 1
            self._move()
            if not self.mute:
                self._tell(step)
            next_s += STEP_S / self.speed
            time.sleep(max(0.0, next_s - time.monotonic()))

    def say(self, text: str) -> None:
        self._mav.statustext_send(mavlink.MAV_SEVERITY_ERROR, text.encode())

    def _move(self) -> None:
        velocity = [0.0, 0.0, 0.0]
        if self.armed and self.mode[0] == OFFBOARD:
            forward, right, down = self._velocity
            cos_yaw, sin_yaw = math.cos(self.yaw), math.sin(self.yaw)
            down += self.drift_m_s
            velocity = [cos_yaw * forward - sin_yaw * right, sin_yaw * forward + cos_yaw * right, down]
            self.yaw = math.remainder(self.yaw + self._yaw_rate * STEP_S, 2 * math.pi)
            if self.time_s - self._last_setpoint_s > self.setpoint_loss_s:
                self.mode = (AUTO, LOITER)
        elif self.armed and self.mode == (AUTO, LAND):
            velocity = [0.0, 0.0, 1.0]
        self.position = [p + v * STEP_S for p, v in zip(self.position, velocity, strict=True)]
        self.position[2] = min(self.position[2], 0.0)
        self._moving = velocity
        if self.mode == (AUTO, LAND) and self.position[2] >= 0.0:
            self.armed, self.mode = False, (AUTO, LOITER)

    def _tell(self, step: int) -> None:
        now_ms = round(self.time_s * 1000)
        if step % 50 == 1 and self.heartbeats:
            told = self.armed and not self.tells_disarmed
            base = (128 if told else 0) | (1 if self.mode[0] == OFFBOARD else 29)
            custom = self.mode[0] << 16 | self.mode[1] << 24
            self._mav.heartbeat_send(2, 12, base, custom, 4 if told else 3)
        for stamp_ms in self._stamps(step, now_ms):
            self._mav.attitude_send(stamp_ms, 0, 0, self.yaw, 0, 0, 0)
        if step % 2 == 0:
            self._mav.local_position_ned_send(now_ms, *self.position, *self._moving)
        if step % 20 == 0:
            armable = self.armable and (not self.armable_modes or self.mode[0] in self.armable_modes)
            sensors = 0x2F | (0x10000000 if armable else 0)
            self._mav.sys_status_send(sensors, sensors, sensors, 0, 12000, -1, -1, 0, 0, 0, 0, 0, 0)
            self._mav.extended_sys_state_send(0, 1 if self.position[2] > -0.02 else 2)

    def _stamps(self, step: int, now_ms: int) -> tuple[int, ...]:
        if not self.swap or step % 10 not in (0, 9):
            return (now_ms,)
        return () if step % 10 == 9 else (now_ms, now_ms - 10)

    def _read(self) -> None:
        while True:
            try:
                data = self._socket.recv(4096)
            except BlockingIOError:
                return
            for message in self._parser.parse_buffer(data) or []:
                self._handle(message)

    def _handle(self, message) -> None:
        kind = message.get_type()
        if kind == "SET_POSITION_TARGET_LOCAL_NED":
            assert message.coordinate_frame == mavlink.MAV_FRAME_BODY_NED
            setpoint = (message.vx, message.vy, message.vz, message.yaw_rate)
            self.setpoints.append((time.monotonic(), *setpoint))
            self._velocity, self._yaw_rate = list(setpoint[:3]), setpoint[3]
            self._last_setpoint_s = self.time_s
        elif kind == "COMMAND_LONG" and self.time_s >= self.deaf_s:
            self.commands.append((message.command, message.param1, message.param2))
            result = self._obey(message)
            source = (message.get_srcSystem(), message.get_srcComponent())
            self._mav.command_ack_send(message.command, result, 0, 0, *source)

    def _obey(self, message) -> int:
        if message.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            if message.param1 and self.refuse_arming:
                self.say(self.refuse_arming)
                return REJECTED
            self.armed = bool(message.param1)
        elif message.command == mavlink.MAV_CMD_DO_SET_MODE:
            if not self.ignore_modes:
                self.mode = (int(message.param2), int(message.param3))
        elif message.command == mavlink.MAV_CMD_NAV_LAND:
            self.mode = (AUTO, LAND)
        elif message.command == mavlink.MAV_CMD_REQUEST_MESSAGE and message.param1 == 148:
            self._mav.autopilot_version_send(0xE8FF, 0x011100FF, 0, 0, 1, [0] * 8, [0] * 8, [0] * 8, 0, 0, 1)
        elif message.command not in (
            mavlink.MAV_CMD_REQUEST_MESSAGE,
            mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
        ):
            return UNSUPPORTED
        return ACCEPTED
