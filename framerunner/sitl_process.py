"""The simulator as a child process."""

from __future__ import annotations

from framerunner.child_process import ChildProcess
from sitl.server_settings import VIDEO_PORT


class SitlProcess(ChildProcess):
    """`framerunner sim` as a child process.

    Args:
        scenario: name or file.
        speed: simulated seconds a second.
        instance: shifts its ports.
        links: more links, as `--link` takes them.
    """

    def __init__(
        self, scenario: str, speed: float = 1.0, instance: int = 0, links: tuple[str, ...] = ()
    ) -> None:
        arguments = [
            *("sim", "--lifeline", "--scenario", scenario),
            *("--speed", f"{speed:g}", "--instance", str(instance), "--video-rtp", "off"),
            *(word for link in links for word in ("--link", link)),
        ]
        super().__init__("the simulator", arguments)
        port = VIDEO_PORT + instance
        self.drone_url = f"udpin://127.0.0.1:{14540 + instance}"
        self.video_url = f"http://127.0.0.1:{port}/video"
        self.referee_url = f"http://127.0.0.1:{port}/referee.json"
