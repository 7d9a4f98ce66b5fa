"""The addresses of a simulator's API."""

import pytest

from framerunner.wire.simulator_api import SimulatorApi


@pytest.mark.parametrize(
    ("video", "api"),
    [
        ("http://127.0.0.1:8100/video", "http://127.0.0.1:8100"),
        ("http://[::1]:8100/any/camera?size=2", "http://[::1]:8100"),
        ("https://example.org/video", "https://example.org"),
    ],
)
def test_it_is_at_the_host_and_port_of_its_video(video, api):
    assert SimulatorApi.of_video(video) == SimulatorApi(api)


@pytest.mark.parametrize(
    "camera", ["0", "/dev/video0", "images", "rtsp://10.0.0.1/live", "http://", "http://[", ""]
)
def test_a_camera_that_is_not_on_the_web_has_none(camera):
    assert SimulatorApi.of_video(camera) is None


def test_its_documents_lie_below_it():
    api = SimulatorApi.at("http://10.0.0.2:8100/")
    assert (api.video_url, api.referee_url, api.scenario_url) == (
        "http://10.0.0.2:8100/video",
        "http://10.0.0.2:8100/referee.json",
        "http://10.0.0.2:8100/scenario.json",
    )


@pytest.mark.parametrize("url", ["10.0.0.2:8100", "udpin://0.0.0.0:14540", "http://10.0.0.2:8100/video", ""])
def test_another_url_is_refused_with_a_message(url):
    with pytest.raises(ValueError, match="write http://HOST:PORT"):
        SimulatorApi.at(url)
