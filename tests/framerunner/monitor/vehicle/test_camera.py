"""From where video may be fetched when the drone sends the URL."""

import pytest
from pymavlink.dialects.v20 import common as mavlink

from framerunner.monitor.vehicle.camera import CameraWatch, host_of, refusal


@pytest.mark.parametrize(
    ("url", "host"),
    [
        ("http://127.0.0.1:8100/video", "127.0.0.1"),
        ("http://127.0.0.1:8109/video", "127.0.0.1"),
        ("http://192.168.1.7/video", "192.168.1.7"),
        ("http://192.168.1.7:81/stream", "192.168.1.7"),
        ("https://10.0.0.3:8443/cam-1/video.mjpg", "::ffff:10.0.0.3"),
        ("http://[fd00::1]:8100/video", "fd00::1"),
        ("http://8.8.8.8/video", "8.8.8.8"),
    ],
)
def test_video_may_be_fetched_from_the_sender_of_the_packets(url, host):
    if ":81/" in url:
        assert "port 81 is of another service" in refusal(url, host)
        url = url.replace(":81/", ":8081/")
    assert refusal(url, host) == ""


@pytest.mark.parametrize(
    ("url", "host", "words"),
    [
        ("http://192.168.1.8/video", "192.168.1.7", "packets come from 192.168.1.7"),
        ("http://127.0.0.1:8100/video", "192.168.1.7", "packets come from 192.168.1.7"),
        ("http://192.168.1.7/video", "127.0.0.1", "packets come from 127.0.0.1"),
        ("http://192.168.1.7/video", "", "from an unknown host"),
        ("http://169.254.169.254/latest/meta-data", "10.0.0.1", "packets come from"),
        ("http://0.0.0.0:8100/video", "127.0.0.1", "packets come from"),
        ("http://127.0.0.1:7777/admin?delete=all", "127.0.0.1", "more than a plain path"),
        ("http://127.0.0.1:7777/admin", "127.0.0.1", "on this machine only /video at ports 8100 to 8109"),
        ("http://127.0.0.1:7777/video", "127.0.0.1", "on this machine only"),
        ("http://127.0.0.1:8100/video/", "127.0.0.1", "on this machine only"),
        ("http://[::ffff:127.0.0.1]:7777/video", "127.0.0.1", "on this machine only"),
        ("http://127.0.0.2:7777/video", "127.0.0.2", "on this machine only"),
        ("http://127.0.0.1/video", "127.0.0.1", "on this machine only"),
        ("http://10.0.0.1/video?a=b", "10.0.0.1", "more than a plain path"),
        ("http://10.0.0.1/../video", "10.0.0.1", "more than a plain path"),
        ("http://10.0.0.1/a%0d%0ab", "10.0.0.1", "more than a plain path"),
        ("http://10.0.0.1:22/video", "10.0.0.1", "port 22 is of another service"),
        ("http://example.com/video", "10.0.0.1", "given in numbers"),
        ("http://localhost:8100/video", "127.0.0.1", "given in numbers"),
        ("http://2130706433:8100/video", "127.0.0.1", "given in numbers"),
        ("http://user:secret@127.0.0.1:8100/video", "127.0.0.1", "user name"),
        ("http://127.0.0.1:99999/video", "127.0.0.1", "no address"),
        ("http://127.0.0.1:0/video", "127.0.0.1", "port 0"),
        ("file:///etc/passwd", "127.0.0.1", "only http"),
        ("http://[::1/video", "::1", "no address"),
        ("http:///video", "127.0.0.1", "names no host"),
    ],
)
def test_other_urls_are_refused_with_a_reason(url, host, words):
    assert words in refusal(url, host)


def test_video_may_be_fetched_from_the_host_of_the_link():
    assert host_of("tcpout://drone.example:5760") == "drone.example"
    assert host_of("udpin://0.0.0.0:14550") == ""
    assert host_of("serial:///dev/ttyUSB0:57600") == ""
    assert refusal("http://drone.example:8100/video", "10.0.0.1", "drone.example") == ""
    assert refusal("ftp://drone.example/video", "10.0.0.1", "drone.example")
    assert refusal("http://localhost:7777/video", "127.0.0.1", "localhost")


@pytest.mark.parametrize("confirmed", ["192.168.1.7", "192.168.1.7:81"])
def test_video_may_be_fetched_from_confirmed_hosts(confirmed):
    assert refusal("http://192.168.1.7:81/stream?size=1", "127.0.0.1", "", (confirmed,)) == ""
    assert refusal("http://192.168.1.8:81/stream", "127.0.0.1", "", (confirmed,))
    assert refusal("ftp://192.168.1.7:81/stream", "127.0.0.1", "", (confirmed,))


def test_a_confirmed_ipv6_host_with_a_port_is_in_brackets():
    assert refusal("http://[fd00::7]:81/stream?size=1", "127.0.0.1", "", ("[fd00::7]:81",)) == ""


def told(uri, number=1):
    return mavlink.MAVLink_video_stream_information_message(
        number, 2, 0, 1, 10.0, 320, 240, 0, 0, 90, b"camera", uri, 0
    )


def test_the_request_is_repeated_until_the_camera_answers_and_its_first_http_stream_counts():
    watch = CameraWatch(1)
    assert watch.request(0.0) is None
    watch.see(100)
    asked = watch.request(0.0)
    assert (asked.target_system, asked.target_component) == (1, 100)
    assert (asked.command, asked.param1) == (512, 269)
    assert watch.request(1.0) is None
    assert watch.request(2.5) is not None
    watch.take(told(b"5600"), "127.0.0.1")
    watch.take(told(b"http://127.0.0.1:8100/video", 2), "127.0.0.1")
    watch.take(told(b"http://127.0.0.1:8101/video", 3), "127.0.0.1")
    assert watch.url == "http://127.0.0.1:8100/video"
    assert watch.request(99.0) is None


def test_a_camera_that_does_not_answer_gets_eight_requests():
    watch = CameraWatch(1)
    watch.see(100)
    assert sum(watch.request(3.0 * count) is not None for count in range(50)) == 8


def test_a_refused_url_is_reported():
    watch = CameraWatch(1)
    watch.take(told(b"http://8.8.8.8/video"), "127.0.0.1")
    assert watch.url is None
    assert "http://8.8.8.8/video is not fetched" in watch.problem
    assert "--camera-host" in watch.problem
