"""Shows a recorded flight in the terminal, and its images as video, at any speed."""

from __future__ import annotations

import asyncio
import sys
from time import monotonic

from rich.console import Console
from rich.live import Live
from rich.table import Table

from framerunner.flying.display import MomentLines, moment_table
from framerunner.recording.events import Crossed, Recorded, RecordedImage, time_of_event
from framerunner.terminal import say
from offboard.app import Moment
from sitl.pacing.pacer import Pacer
from sitl.video import VideoServer

_REFRESH_S = 0.1
_AHEAD_S = 0.005  # events due within this are shown now


class ReplayDisplay:
    """A live table in a terminal; elsewhere a line at every change of state and crossing, and every 10 s."""

    def __init__(self, title: str) -> None:
        self._title = title
        self._console = Console(file=sys.stderr)
        self._live: Live | None = None
        self._shown_s = 0.0
        self._crossed: list[str] = []
        self._lines = MomentLines()

    def __enter__(self) -> ReplayDisplay:
        if self._console.is_terminal:
            self._live = Live(console=self._console, auto_refresh=False, transient=True)
            self._live.start()
        return self

    def __exit__(self, *_error: object) -> None:
        if self._live is not None:
            self._live.stop()

    def cross(self, crossed: Crossed) -> None:
        """Count a crossing."""
        self._crossed.append(crossed.colour)

    def see(self, moment: Moment) -> None:
        """Show a tick of the flight."""
        if self._live is None:
            self._lines.show(moment, self._crossed, also=str(self._crossed))  # a line at each crossing
        elif monotonic() - self._shown_s >= _REFRESH_S:
            self._shown_s = monotonic()
            self._live.update(self._table(moment), refresh=True)

    def _table(self, moment: Moment) -> Table:
        table = moment_table(self._title, moment, f"{moment.flight_time_s:.1f} s")
        table.add_row("crossed", ", ".join(self._crossed) or "none")
        return table


async def replay(recorded: Recorded, speed: float, video: VideoServer | None) -> None:
    """Show a flight to its end.

    Args:
        recorded: the flight.
        speed: ratio of vehicle time to wall time; 0 for as fast as possible.
        video: server for the images, started and closed here; None serves none.

    Raises:
        RecordingError: the recording is damaged; what precedes the damage is shown.
        VideoError: the port is in use.
    """
    if video is not None:
        await video.start()
        say(f"video: {video.url}  (stream: {video.url}video)")
    try:
        with ReplayDisplay(recorded.title) as display:
            pacer: Pacer | None = None
            for event in recorded.events():
                wait_s = 0.0
                if speed > 0.0:
                    time_us, now_s = time_of_event(event), monotonic()
                    pacer = pacer or Pacer(speed, now_s, time_us)
                    wait_s = pacer.wait_s(now_s, time_us)
                await asyncio.sleep(wait_s if wait_s > _AHEAD_S else 0.0)  # always, so that Ctrl-C is handled
                if isinstance(event, Moment):
                    display.see(event)
                elif isinstance(event, Crossed):
                    display.cross(event)
                elif isinstance(event, RecordedImage) and video is not None:
                    video.publish(event.image, event.time_us)
    finally:
        if video is not None:
            await video.close()
