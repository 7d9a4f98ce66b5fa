"""H.264 over RTP, decoded by FFmpeg from the description that is served."""

import socket
import threading

import av
import numpy as np
import pytest

from framerunner.wire.transports.urls import LinkError
from scenarios.models import Camera
from sitl.streaming.h264 import RtpSender
from tests.free_ports import free_port

CAMERA = Camera(width_px=320, height_px=240, rate_hz=10.0)
RED, GREEN, BLUE = (0, 0, 255), (0, 255, 0), (255, 0, 0)


def painted(colour, camera=CAMERA):
    """An image in one colour with a frame of another around it."""
    image = np.full((camera.height_px, camera.width_px, 3), 90, np.uint8)
    image[40:-40, 40:-40] = colour
    return image


class Watcher(threading.Thread):
    """Decodes a stream until it has seen enough images; remembers the colour in the middle of each."""

    def __init__(self, description, wanted):
        super().__init__(daemon=True)
        self._description, self._wanted = description, wanted
        self.middles, self.borders, self.stamps = [], [], []

    def run(self):
        options = {"protocol_whitelist": "file,udp,rtp", "probesize": "50000", "analyzeduration": "100000"}
        with av.open(str(self._description), options=options, timeout=10) as container:
            for frame in container.decode(video=0):
                image = frame.to_ndarray(format="bgr24")
                self.middles.append(image[image.shape[0] // 2, image.shape[1] // 2].astype(int))
                self.borders.append(image[10, 10].astype(int))
                if frame.time is not None:  # the first have none
                    self.stamps.append(frame.time)
                if len(self.middles) >= self._wanted:
                    return


def test_a_watcher_sees_the_painted_colours(tmp_path):
    sender = RtpSender(("127.0.0.1", free_port(2)), CAMERA)
    description = tmp_path / "video.sdp"
    description.write_text(sender.description(), encoding="ascii")
    watcher = Watcher(description, 30)
    watcher.start()
    number = 0
    while watcher.is_alive() and number < 600:
        sender.send(painted((RED, GREEN, BLUE)[number // 20 % 3]), number * 100_000)
        number += 1
        watcher.join(0.02)
    sender.close()
    assert len(watcher.middles) == 30
    for middle, border in zip(watcher.middles, watcher.borders, strict=True):
        assert min(np.abs(middle - colour).max() for colour in (RED, GREEN, BLUE)) < 40
        assert np.abs(border - 90).max() < 20
    seen = {int(np.argmax(middle)) for middle in watcher.middles}
    assert len(seen) >= 2
    gaps = np.diff(watcher.stamps)
    assert len(gaps) > 10
    assert (gaps > 0).all()
    assert np.median(gaps) == pytest.approx(0.1, abs=0.02)


def test_the_stream_goes_on_when_vehicle_time_begins_again():
    port = free_port(2)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", port))
        listener.settimeout(5.0)
        sender = RtpSender(("127.0.0.1", port), CAMERA)
        stamps = []
        for number in (7, 8, 9, 0, 1):
            sender.send(painted(RED), number * 100_000)
            packet = listener.recv(2000)
            stamps.append(int.from_bytes(packet[4:8]))
            while packet[1] < 128:
                packet = listener.recv(2000)
        sender.close()
    assert np.diff(stamps).tolist() == [9000] * 4


def test_who_comes_late_sees_something_within_a_second_of_video():
    packets = []
    port = free_port(2)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", port))
        listener.settimeout(5.0)
        sender = RtpSender(("127.0.0.1", port), CAMERA)
        for number in range(25):
            sender.send(painted(RED), number * 100_000)
            packets.append(listener.recv(2000))
            while packets[-1][1] < 128:  # without the mark: more of this image follows
                packets.append(listener.recv(2000))
        sender.close()
    assert {packet[1] & 127 for packet in packets} == {96}
    assert max(map(len, packets)) <= 1200
    kinds = [_units(packet[12:]) for packet in packets]
    parameter_sets = [number for number, units in enumerate(kinds) if 7 in units]
    assert len(parameter_sets) == 3  # 25 images at 10 Hz


def _units(payload):
    """Types of the NAL units in an RTP payload: single, or several in a STAP-A (RFC 6184)."""
    kind = payload[0] & 31
    if kind != 24:
        return [kind]
    units, place = [], 1
    while place + 2 < len(payload):
        units.append(payload[place + 2] & 31)
        place += 2 + int.from_bytes(payload[place : place + 2], "big")
    return units


def test_odd_sizes_are_sent():
    sender = RtpSender(("127.0.0.1", free_port(2)), Camera(width_px=321, height_px=241))
    sender.send(painted(RED, Camera(width_px=321, height_px=241)), 0)
    sender.close()


def test_stamps_count_the_watchers_seconds():
    ports = free_port(2)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", ports))
        listener.settimeout(5.0)
        sender = RtpSender(("127.0.0.1", ports), CAMERA, speed=4.0)
        stamps = []
        for number in range(2):
            sender.send(painted(RED), number * 1_000_000)
            stamp = None
            while True:
                packet = listener.recv(2000)
                stamp = int.from_bytes(packet[4:8], "big")
                if packet[1] >= 128:
                    break
            stamps.append(stamp)
        sender.close()
    assert (stamps[1] - stamps[0]) % 2**32 == 90_000 // 4


def test_an_unknown_host_is_said_in_one_line():
    with pytest.raises(LinkError, match="RTP no such host:5600 cannot be sent to") as error:
        RtpSender(("no such host", 5600), CAMERA)
    assert "\n" not in str(error.value)
