"""Where video may be asked for, when the drone names the address."""

import pytest
from pymavlink.dialects.v20 import common as mavlink

from monitor.vehicle.camera import CameraWatch, host_of, refusal


@pytest.mark.parametrize(
    "url",
    [
        "http://127.0.0.1:8100/video",
        "http://192.168.1.7/video",
        "https://10.0.0.3:8443/video",
        "http://[fd00::1]:8100/video",
    ],
)
def test_this_machine_and_private_networks_may_be_asked(url):
    assert refusal(url) == ""


@pytest.mark.parametrize(
    "url",
    [
        "http://8.8.8.8/video",
        "http://example.com/video",
        "http://localhost/video",
        "http://169.254.169.254/latest/meta-data",
        "http://0.0.0.0:8100/video",
        "http://[::ffff:8.8.8.8]/video",
        "http://user:secret@127.0.0.1/video",
        "http://127.0.0.1:99999/video",
        "http://127.0.0.1:0/video",
        "file:///etc/passwd",
        "ftp://127.0.0.1/video",
        "http://[::1/video",
        "http:///video",
        "http://2130706433/video",
    ],
)
def test_all_else_is_refused_in_words(url):
    assert refusal(url)


def test_the_host_that_the_link_goes_to_may_be_asked():
    assert host_of("tcpout://drone.example:5760") == "drone.example"
    assert host_of("udpin://0.0.0.0:14550") == ""
    assert host_of("serial:///dev/ttyUSB0:57600") == ""
    assert refusal("http://drone.example:8100/video", "drone.example") == ""
    assert refusal("ftp://drone.example/video", "drone.example")


def told(uri, number=1):
    return mavlink.MAVLink_video_stream_information_message(
        number, 2, 0, 1, 10.0, 320, 240, 0, 0, 90, b"camera", uri, 0
    )


def test_a_camera_is_asked_until_it_answers_and_its_first_http_stream_counts():
    watch = CameraWatch(1)
    assert watch.question(0.0) is None
    watch.see(100)
    asked = watch.question(0.0)
    assert (asked.target_system, asked.target_component) == (1, 100)
    assert (asked.command, asked.param1) == (512, 269)
    assert watch.question(1.0) is None
    assert watch.question(2.5) is not None
    watch.take(told(b"5600"))
    watch.take(told(b"http://127.0.0.1:8100/video", 2))
    watch.take(told(b"http://127.0.0.1:9/other", 3))
    assert watch.url == "http://127.0.0.1:8100/video"
    assert watch.question(99.0) is None


def test_a_camera_that_never_answers_is_left_alone():
    watch = CameraWatch(1)
    watch.see(100)
    assert sum(watch.question(3.0 * count) is not None for count in range(50)) == 8


def test_a_refused_address_is_told():
    watch = CameraWatch(1)
    watch.take(told(b"http://8.8.8.8/video"))
    assert watch.url is None
    assert "http://8.8.8.8/video is not asked for" in watch.problem
