"""A UDP proxy between the app and the simulator that impairs the link, by a seed."""

from __future__ import annotations

import select
import socket
import threading
import time
from random import Random

from tests.framerunner.simulated_link import Direction, Impairment


class UdpProxy(threading.Thread):
    """Passes datagrams on, both ways.

    Args:
        impairment: of each way; silences count from the start.
        app_port: where the app listens.

    Attributes:
        port: to which the vehicle sends.
    """

    def __init__(self, impairment: Impairment, app_port: int, seed: int = 0):
        super().__init__(daemon=True)
        self._vehicle_side, self._app_side = _bound(), _bound()
        self.port = self._vehicle_side.getsockname()[1]
        self._app = ("127.0.0.1", app_port)
        self._vehicle = None
        self._ways = tuple(Direction(impairment, Random(f"{way} {seed}")) for way in ("down", "up"))
        self._halt = threading.Event()

    def run(self):
        began_s = time.monotonic()
        down, up = self._ways
        while not self._halt.is_set():
            ready, _, _ = select.select([self._vehicle_side, self._app_side], [], [], 0.001)
            now_us = int(1e6 * (time.monotonic() - began_s))
            if self._vehicle_side in ready:
                data, self._vehicle = self._vehicle_side.recvfrom(4096)
                down.send(now_us, lambda data=data: self._app_side.sendto(data, self._app))
            if self._app_side in ready:
                data = _received(self._app_side)
                if data and self._vehicle is not None:
                    up.send(now_us, lambda data=data: self._vehicle_side.sendto(data, self._vehicle))
            down.deliver(now_us)
            up.deliver(now_us)

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self._halt.set()
        self.join()
        self._vehicle_side.close()
        self._app_side.close()


def _bound():
    bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    bound.bind(("127.0.0.1", 0))
    return bound


def _received(sock):
    try:
        return sock.recv(4096)
    except ConnectionRefusedError:  # nobody listens there yet
        return b""
