"""A simulator's HTTP API: its one URL and what is served below it.

The simulator and the virtual camera serve it (`docs/monitor-channels.md`). Whoever knows only the address of
a camera finds the API by `SimulatorApi.of_video`; there is no other rule.
"""

from __future__ import annotations

from dataclasses import dataclass
from urllib.parse import urlsplit, urlunsplit

VIDEO_PATH = "/video"
REFEREE_PATH = "/referee.json"
SCENARIO_PATH = "/scenario.json"


@dataclass(frozen=True, slots=True)
class SimulatorApi:
    """Where a simulator's API is.

    Attributes:
        url: scheme, host and port, such as "http://127.0.0.1:8100"; no slash at the end.
    """

    url: str

    @classmethod
    def at(cls, url: str) -> SimulatorApi:
        """The API at a URL that somebody has written down.

        Raises:
            ValueError: it is none; the message is one line for people.
        """
        api = cls.of_video(url)
        if api is None or urlsplit(url).path not in ("", "/"):
            raise ValueError(
                f"'{url}' is no URL of a simulator; write http://HOST:PORT, as http://127.0.0.1:8100"
            )
        return api

    @classmethod
    def of_video(cls, video_url: str) -> SimulatorApi | None:
        """The API that a video may belong to: that of the same scheme, host and port. Nothing is asked.

        Returns:
            None for a video that does not come over HTTP: a device, a file, RTSP.
        """
        try:
            parts = urlsplit(video_url)
            is_web = parts.scheme in ("http", "https") and bool(parts.hostname)
        except ValueError:
            return None
        return cls(urlunsplit((parts.scheme, parts.netloc, "", "", ""))) if is_web else None

    @property
    def video_url(self) -> str:
        """Of the camera's images, as MJPEG."""
        return self.url + VIDEO_PATH

    @property
    def referee_url(self) -> str:
        """Of the referee's view of the try, as JSON."""
        return self.url + REFEREE_PATH

    @property
    def scenario_url(self) -> str:
        """Of what is flown, as JSON."""
        return self.url + SCENARIO_PATH
