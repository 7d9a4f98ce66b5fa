"""A program that passes on what a motion capture server tracks, as lines of JSON in UDP datagrams.

It uses the library `motioncapture` (https://github.com/IMRCLab/libmotioncapture), which has clients of the
usual servers. It is a process of its own, because that library waits for the server without end.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import threading
import time
from importlib import import_module

KINDS = ("optitrack", "qualisys", "vicon", "vrpn")
"""Servers, by the library's names."""


def main(kind: str, host: str, port: int) -> None:
    """Connect to a server and send each frame's bodies to a UDP port of this machine, until stdin ends."""
    threading.Thread(target=_end_with_stdin, daemon=True).start()
    capture = import_module("motioncapture").connect(kind, {"hostname": host})
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        while True:
            capture.waitForNextFrame()
            time_s = time.monotonic()
            for name, body in capture.rigidBodies.items():
                x, y, z = (float(value) for value in body.position)
                turn = body.rotation
                record = {"time_s": time_s, "name": name, "x": x, "y": y, "z": z}
                record |= {"qw": turn.w, "qx": turn.x, "qy": turn.y, "qz": turn.z}
                sender.sendto(json.dumps(record).encode(), ("127.0.0.1", port))


def _end_with_stdin() -> None:
    sys.stdin.read()
    os._exit(0)


if __name__ == "__main__":
    try:
        main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
    except RuntimeError as error:  # the library's only exception
        sys.exit(f"{sys.argv[1]}://{sys.argv[2]}: {error}")
