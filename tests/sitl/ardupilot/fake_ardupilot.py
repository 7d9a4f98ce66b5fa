"""A protocol fake of ArduPilot's JSON interface: binary frames out over UDP, one line of JSON back for each.

Its parser is as strict as ArduPilot's: no spaces, and a line counts only after the end of another line.
"""

import re
import socket
import struct
import sys
import time

LAYOUTS = {16: (18458, struct.Struct("<HHI16H")), 32: (29569, struct.Struct("<HHI32H"))}
NUMBER = r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
ARRAYS = {"gyro": 3, "accel_body": 3, "position": 3, "quaternion": 4, "velocity": 3}


def parse(data):
    """The state in an answer, as ArduPilot's parser finds it."""
    text = data.decode("ascii")
    assert text.startswith("\n")
    assert text.endswith("\n")
    assert " " not in text
    found = {"timestamp": float(re.search(rf'"timestamp":({NUMBER})', text)[1])}
    for name, count in ARRAYS.items():
        values = ",".join([f"({NUMBER})"] * count)
        found[name] = tuple(map(float, re.search(rf'"{name}":\[{values}\]', text).groups()))
    return found


class FakeArduPilot:
    """Sends a frame and waits for its answer; `number` counts the answered ones."""

    def __init__(self, port, channels=16):
        self.magic, self.layout = LAYOUTS[channels]
        self.channels, self.number, self.answers = channels, 0, []
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.settimeout(5.0)
        self.place = ("127.0.0.1", port)

    def packet(self, pulses, number=None):
        filled = [*pulses, *([0] * (self.channels - len(pulses)))]
        return self.layout.pack(self.magic, 500, self.number if number is None else number, *filled)

    def send(self, pulses, number=None):
        self.socket.sendto(self.packet(pulses, number), self.place)

    def receive(self):
        self.answers.append(parse(self.socket.recv(4096)))
        self.number += 1
        return self.answers[-1]

    def step(self, pulses):
        self.send(pulses)
        return self.receive()

    def close(self):
        self.socket.close()


def run(instance):
    """Step for ever, sending a frame again after a second without an answer, as ArduPilot does."""
    fake = FakeArduPilot(9002 + 10 * instance)
    fake.socket.settimeout(1.0)
    while True:
        fake.send([1400] * 4 if fake.number > 250 else [1000] * 4)
        try:
            fake.receive()
        except TimeoutError:
            continue
        time.sleep(0.0005)


if __name__ == "__main__":
    run(int(sys.argv[sys.argv.index("-I") + 1]))
