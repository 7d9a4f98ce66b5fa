"""A simulator's HTTP API: its base URL and the paths below it.

The simulator and the virtual camera serve it (`docs/monitor-channels.md`).
"""

from __future__ import annotations

from dataclasses import dataclass
from urllib.parse import urlsplit, urlunsplit

VIDEO_PATH = "/video"
REFEREE_PATH = "/referee.json"
SCENARIO_PATH = "/scenario.json"


@dataclass(frozen=True, slots=True)
class SimulatorApi:
    """The address of a simulator's API."""

    url: str  # scheme, host and port, such as "http://127.0.0.1:8100"; no slash at the end

    @classmethod
    def at(cls, url: str) -> SimulatorApi:
        """The API at a URL given by a user.

        Raises:
            ValueError: it is not such a URL; the message is one line for people.
        """
        api = cls.of_video(url)
        if api is None or urlsplit(url).path not in ("", "/"):
            raise ValueError(
                f"'{url}' is no URL of a simulator; write http://HOST:PORT, as http://127.0.0.1:8100"
            )
        return api

    @classmethod
    def of_video(cls, video_url: str) -> SimulatorApi | None:
        """The API that a video may belong to: with the same scheme, host and port; nothing is requested.

        Returns:
            None for a video that is not sent over HTTP: a device, a file, RTSP.
        """
        try:
            parts = urlsplit(video_url)
            is_web = parts.scheme in ("http", "https") and bool(parts.hostname)
        except ValueError:
            return None
        return cls(urlunsplit((parts.scheme, parts.netloc, "", "", ""))) if is_web else None

    @property
    def video_url(self) -> str:
        """URL of the camera's images, as MJPEG."""
        return self.url + VIDEO_PATH

    @property
    def referee_url(self) -> str:
        """URL of the standing of the try, as JSON."""
        return self.url + REFEREE_PATH

    @property
    def scenario_url(self) -> str:
        """URL of the scenario, as JSON."""
        return self.url + SCENARIO_PATH
