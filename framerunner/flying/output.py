"""What a flight leaves, and where it is shown."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class OutputSettings:
    """What a flight leaves, and where it is shown; the options of `framerunner fly` of these names.

    Attributes:
        out: folder in which this flight's folder is made
        record: write flight.mcap as well, for `framerunner replay` and Foxglove
        video: write video.avi also in lockstep; in real time it is always written
        monitor: open the Game Monitor as well, on http://127.0.0.1:8080/; it stays open until Ctrl-C
        wait_for_viewer: with --monitor: fly when a browser shows it
        monitor_link: MAVLink URL of a monitor that runs already, such as udpout://127.0.0.1:14550
    """

    out: Path = Path("runs")
    record: bool = False
    video: bool = False
    monitor: bool = False
    wait_for_viewer: bool = False
    monitor_link: str | None = None
