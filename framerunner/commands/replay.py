"""`framerunner replay`: a recorded flight, shown again."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from framerunner.commands import WholeNumber, within
from framerunner.errors import SettingError


def replay(
    flight: Path,
    *,
    speed: float = 1.0,
    fast: bool = False,
    video: Annotated[bool | None, Parameter(negative="--no-video")] = None,
    port: Annotated[WholeNumber, within(0, 65535)] = 8090,
    pilot: str | None = None,
) -> int:
    """Show a flight again: its states in the terminal, its images at http://127.0.0.1:8090/.

    Shows what `framerunner fly --record` wrote. Without a recording, a lockstep flight is flown again, which
    gives exactly the same one, and a real-time flight is shown from its log and video. Stop it with Ctrl-C.

    **Examples**

        framerunner replay runs/20260101-120000-test-case-1

        framerunner replay runs/20260101-120000-test-case-1 --speed 4

        framerunner replay flight.mcap --fast

    Args:
        flight: run folder, or an MCAP file of framerunner's
        speed: simulated seconds a second; 0 as fast as possible
        fast: as fast as possible, as --speed 0
        video: serve the images; by default if the flight is shown at some speed
        port: TCP port of the video; 0 lets the system choose
        pilot: of a mission that has to be flown again and needs one: a Python file, or a name
    """
    speed = 0.0 if fast else speed
    if speed != 0.0 and not 0.01 <= speed <= 1000:
        raise SettingError(f"--speed {speed:g}: must be from 0.01 to 1000, or 0 for as fast as possible")
    with_video = speed > 0.0 if video is None else video

    from framerunner.flying.display import result_lines
    from framerunner.recording.open_recording import recorded_flight
    from framerunner.recording.replay import replay as show
    from offboard.pilot_file import find_pilot
    from sitl.video import VideoServer

    source = None if pilot is None else find_pilot(pilot)
    server = VideoServer(port=port) if with_video else None
    with recorded_flight(flight, source) as recorded:
        asyncio.run(show(recorded, speed, server))
        result = recorded.result
        print("no result: the flight was not judged" if result is None else result_lines(result))
    return 0
