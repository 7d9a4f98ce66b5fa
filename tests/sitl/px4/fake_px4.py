"""A protocol fake of PX4: a TCP client that answers each HIL_SENSOR with one HIL_ACTUATOR_CONTROLS.

It boots as PX4 does: its first sensors get no answer. Armed, it hovers by the truth that the simulator sends.
As a program: fake_px4.py PORT [BOOT_STEPS] [ARM_US]
"""

import socket
import sys
import time

from pymavlink.dialects.v20 import common as mavlink

BOOT_STEPS = 22


class FakePx4:
    """Connects as PX4 does: at once, or as soon as somebody listens.

    `armed_from_us`: vehicle time from which it is armed, and hovers with `output` for each motor.
    """

    def __init__(self, port, boot_steps=BOOT_STEPS, armed_from_us=None, output=0.26):
        self.connection = connect(port)
        self.mav = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
        self.mav.robust_parsing = True
        self.boot_steps, self.armed_from_us, self.output = boot_steps, armed_from_us, output
        self.times_us, self.others = [], {}
        self.down_m_s, self.height_m = 0.0, None
        self.send(self.mav.heartbeat_encode(0, 12, 0, 0, 0))
        self.send(self.mav.command_long_encode(0, 0, 511, 0, 115, 5000, 0, 0, 0, 0, 0))

    def send(self, message):
        self.connection.sendall(message.pack(self.mav))

    def serve(self, steps=None):
        """Answer until the simulator goes, or this many sensors have come."""
        while steps is None or len(self.times_us) < steps:
            try:
                data = self.connection.recv(4096)
            except ConnectionResetError:
                return
            if not data:
                return
            for message in self.mav.parse_buffer(data) or ():
                self.take(message)

    def take(self, message):
        if message.get_type() != "HIL_SENSOR":
            self.others[message.get_type()] = message
            if message.get_type() == "HIL_STATE_QUATERNION":
                self.down_m_s, self.height_m = message.vz / 100, message.alt / 1000
            return
        self.times_us.append(message.time_usec)
        if len(self.times_us) <= self.boot_steps:
            return
        armed = self.armed_from_us is not None and message.time_usec >= self.armed_from_us
        controls = [self.output + 0.02 * self.down_m_s] * 4 if armed else [0.0] * 4
        mode = (128 if armed else 0) | 1
        self.send(self.mav.hil_actuator_controls_encode(message.time_usec, controls + [0.0] * 12, mode, 1))

    def close(self):
        self.connection.close()


def connect(port):
    for _ in range(2000):
        try:
            connection = socket.create_connection(("127.0.0.1", port))
        except ConnectionRefusedError:
            time.sleep(0.005)
            continue
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        return connection
    raise TimeoutError(f"nobody listens on {port}")


if __name__ == "__main__":
    numbers = [int(word) for word in sys.argv[1:]]
    FakePx4(numbers[0], *numbers[1:]).serve()
