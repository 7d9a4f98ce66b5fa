"""A protocol fake of ArduCopter on a UDP socket: what it does otherwise than the PX4 look-alike."""

from __future__ import annotations

from pymavlink.dialects.v20 import common as mavlink

from tests.offboard.udp_vehicle import ACCEPTED, REJECTED, UdpVehicle

STABILIZE, GUIDED, LOITER, LAND, BRAKE = 0, 4, 5, 9, 17
TAKEOFF_S = 0.6  # from the request until the drone leaves the ground


class UdpArduCopter(UdpVehicle):
    """Sends only what was requested, takes off only on request, and follows velocities only in the air.

    Fields that a test may read: `takeoffs`, the heights requested; `early`, setpoints that it received on the
    ground between a request to take off and lift-off, each of which ends the take-off.
    """

    def __init__(self, port: int, **options):
        super().__init__(port, **options)
        self.mode = (STABILIZE, 0)
        self.has_position = True
        self.requested: set[int] = set()
        self.refused: set[int] = set()  # messages that it never sends
        self.type = mavlink.MAV_TYPE_QUADROTOR
        self.takeoffs: list[float] = []
        self.early = 0
        self.ignores_takeoff = False
        self._flying = False
        self._takeoff_s: float | None = None
        self._moving = [0.0, 0.0, 0.0]

    def _move(self) -> None:
        velocity = [0.0, 0.0, 0.0]
        if self._takeoff_s is not None and self.time_s - self._takeoff_s > TAKEOFF_S:
            self._flying, self._takeoff_s = True, None
            velocity = [0.0, 0.0, -1.0]
            self._last_setpoint_s = self.time_s
        mode = self.mode[0]
        if self._flying and mode == GUIDED and self.time_s - self._last_setpoint_s < self.setpoint_loss_s:
            velocity = list(self._velocity)
            self.yaw += self._yaw_rate * 0.01
        elif self._flying and mode == LAND:
            velocity = [0.0, 0.0, 1.0]
        self.position = [p + v * 0.01 for p, v in zip(self.position, velocity, strict=True)]
        self._moving = velocity
        if self._flying and mode == LAND and self.position[2] >= 0.0:
            self.position[2] = 0.0
            self.armed = self._flying = False

    def _tell(self, step: int) -> None:
        now_ms = round(self.time_s * 1000)
        if step % 50 == 1:
            base = (128 if self.armed else 0) | 81
            self._mav.heartbeat_send(self.type, 3, base, self.mode[0], 4 if self.armed else 3)
        if mavlink.MAVLINK_MSG_ID_ATTITUDE in self.requested:
            self._mav.attitude_send(now_ms, 0, 0, self.yaw, 0, 0, 0)
        if mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED in self.requested and step % 2 == 0:
            self._mav.local_position_ned_send(now_ms, *self.position, *self._moving)
        if mavlink.MAVLINK_MSG_ID_SYS_STATUS in self.requested and step % 20 == 0:
            sensors = 0x2F | (0x10000000 if self.armable else 0)
            self._mav.sys_status_send(sensors, sensors, sensors, 0, 12000, -1, -1, 0, 0, 0, 0, 0, 0)
        if mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE in self.requested and step % 10 == 0:
            self._mav.extended_sys_state_send(0, 2 if self._flying else 1)

    def _handle(self, message) -> None:
        if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
            if self.mode[0] != GUIDED:
                return
            assert message.type_mask == 0b0101_1100_0111  # velocity and yaw rate
            if self._takeoff_s is not None:
                self._takeoff_s = None
                self.early += 1
            if self._flying:
                # It turns the velocity once, with its heading at the arrival.
                super()._handle(message)
                self._velocity = [*self._turned(*self._velocity[:2]), self._velocity[2]]
            return
        super()._handle(message)

    def _turned(self, forward: float, right: float) -> tuple[float, float]:
        from math import cos, sin

        c, s = cos(self.yaw), sin(self.yaw)
        return c * forward - s * right, s * forward + c * right

    def _obey(self, message) -> int:
        command = message.command
        if command == mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
            self.requested |= {int(message.param1)} - self.refused
        elif command == mavlink.MAV_CMD_DO_SET_MODE:
            mode = int(message.param2)
            if mode == GUIDED and not self.has_position:
                self.say("Mode change to GUIDED failed: requires position")
                return mavlink.MAV_RESULT_FAILED
            self.mode = (mode, 0)
        elif command == mavlink.MAV_CMD_NAV_TAKEOFF:
            if not self.armed or self._flying or self.mode[0] != GUIDED:
                return REJECTED
            self.takeoffs.append(message.param7)
            if not self.ignores_takeoff:
                self._takeoff_s = self.time_s
        elif command == mavlink.MAV_CMD_NAV_LAND:
            self.mode = (LAND, 0)
        elif command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM and message.param1 == 0:
            self.armed = self._flying = False
        else:
            return super()._obey(message)
        return ACCEPTED
