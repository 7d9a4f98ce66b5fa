"""One flight from start to verdict, with everything it leaves behind."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Iterator
from contextlib import AsyncExitStack, ExitStack, closing, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

import aiohttp

from firmware_py.airframe import load_airframe
from framerunner.display import FlightDisplay
from framerunner.errors import SettingError
from framerunner.judges import Judge, ask_referee, choose_judge
from framerunner.lockstep import Flown, lockstep_flight
from framerunner.lockstep_progress import LockstepProgress
from framerunner.pictures import Outcome as JudgedOutcome
from framerunner.pictures import track_picture
from framerunner.recorder import FlightRecorder, RecordingCamera, VideoFile
from framerunner.run_folder import RunFolder
from framerunner.sitl_process import SitlProcess
from offboard.app import Moment, Outcome, fly_mission
from offboard.mavsdk_drone import MavsdkDrone
from offboard.mission import Mission
from scenarios.ground import start_position
from scenarios.loader import dump_yaml
from scenarios.models import Scenario
from vision.sources import open_source

_SITL_START_S = 20.0
COMPLETED = ("clean", "completed")


@dataclass(frozen=True, slots=True)
class FlightSettings:
    """What to fly, with what.

    Attributes:
        scenario: the layout; the mission is told only where the drone stands.
        mission: the chart.
        drone_url: MAVLink URL; None starts a simulator.
        camera_url: of the drone's camera; None with a simulator.
        speed: of the simulator.
        instance: of the simulator.
        out: folder of all runs.
        lockstep: simulated in this process, in its own time, instead of in real time.
    """

    scenario: Scenario
    mission: Mission
    drone_url: str | None
    camera_url: str | None
    speed: float
    instance: int
    out: Path
    lockstep: bool = False


async def fly_once(settings: FlightSettings) -> int:
    """Fly, judge, write.

    Returns:
        0 completed, 1 flown but not completed, 130 stopped with Ctrl-C.

    Raises:
        DroneError: the drone cannot be reached or made ready.
        CameraError: the camera gives no image.
        SettingError: the simulator cannot be started.
    """
    started = datetime.now(UTC)
    fly = _fly_in_lockstep if settings.lockstep else _fly_in_real_time
    with _run_folder(settings) as folder:
        recorder = FlightRecorder()
        flown = await fly(settings, folder, recorder)
        result = {
            **flown.result,
            "wall_time_s": recorder.wall_time_s,
            "real_time_factor": recorder.real_time_factor,
            "started": started.isoformat(timespec="seconds"),
        }
        folder.write_result(result)
        track_picture(settings.scenario, flown.track, JudgedOutcome.from_result(result), folder.track)
    _say_result(result, folder)
    if flown.outcome.interrupted:
        return 130
    return 0 if result["verdict"] in COMPLETED else 1


async def _fly_in_lockstep(settings: FlightSettings, folder: RunFolder, recorder: FlightRecorder) -> Flown:
    scenario = settings.scenario
    folder.scenario.write_text(dump_yaml(scenario), encoding="utf-8")
    video = VideoFile(folder.video, scenario.camera.rate_hz)
    with closing(video), LockstepProgress(scenario.try_limit_s) as progress:

        def observe(moment: Moment) -> None:
            recorder.see(moment)
            progress.see(moment)

        return await lockstep_flight(
            scenario, settings.mission, observer=observe, on_image=lambda _time_us, image: video.write(image)
        )


async def _fly_in_real_time(settings: FlightSettings, folder: RunFolder, recorder: FlightRecorder) -> Flown:
    async with AsyncExitStack() as stack:
        session = await stack.enter_async_context(aiohttp.ClientSession())
        drone_url, camera_url, sitl = await _vehicle(settings, folder, session, stack)
        judge = await choose_judge(settings.scenario, camera_url, session)
        flight = asyncio.create_task(_fly(settings, folder, recorder, judge, (drone_url, camera_url)))
        outcome = await (flight if sitl is None else sitl.guard(flight))
        ended = None if outcome.ended == "finished" else outcome.reason
        report = await judge.report(outcome.mission_state, ended)
        standing = await judge.standing()
    track = recorder.track(standing.began_us if standing else None)
    result = {
        "scenario": settings.scenario.name,
        "mission": settings.mission.name,
        "seed": None,  # real time has no lockstep's repeatability
        **report,
        "mission_state": outcome.mission_state,
        "ended": outcome.ended,
        "seconds_in_state": track.seconds_in_state(),
        "judged_by": judge.source,
        "version": metadata.version("framerunner"),
    }
    return Flown(result, outcome, track)


@contextmanager
def _run_folder(settings: FlightSettings) -> Iterator[RunFolder]:
    """Make the folder; take it away again if the flight did not begin and left nothing."""
    folder = RunFolder(settings.out, settings.scenario.name)
    try:
        yield folder
    finally:
        folder.remove_if_empty()


async def _vehicle(
    settings: FlightSettings, folder: RunFolder, session: aiohttp.ClientSession, stack: AsyncExitStack
) -> tuple[str, str, SitlProcess | None]:
    """Return the drone's and the camera's URL, and the simulator if one was started."""
    if settings.drone_url is not None and settings.camera_url is not None:
        return settings.drone_url, settings.camera_url, None
    # The simulator reads the very scenario that was checked here, whatever becomes of its file.
    folder.scenario.write_text(dump_yaml(settings.scenario), encoding="utf-8")
    sitl = await stack.enter_async_context(
        SitlProcess(str(folder.scenario), settings.speed, settings.instance)
    )
    await sitl.guard(asyncio.create_task(_wait_for_sitl(sitl.referee_url, session)))
    return sitl.drone_url, sitl.video_url, sitl


async def _wait_for_sitl(url: str, session: aiohttp.ClientSession) -> None:
    loop = asyncio.get_running_loop()
    limit_s = loop.time() + _SITL_START_S
    while await ask_referee(url, session) is None:
        if loop.time() > limit_s:
            raise SettingError(f"the simulator did not start within {_SITL_START_S:g} s")
        await asyncio.sleep(0.05)


async def _fly(
    settings: FlightSettings, folder: RunFolder, recorder: FlightRecorder, judge: Judge, urls: tuple[str, str]
) -> Outcome:
    scenario = settings.scenario
    x_m, y_m, z_m = start_position(scenario)
    with ExitStack() as files:
        hang_report = files.enter_context(folder.hang_report.open("w", encoding="utf-8"))
        height_m = load_airframe(scenario.airframe).envelope_m[2]
        start_arena = (x_m, y_m, z_m + height_m / 2, scenario.start.yaw_rad)
        drone = MavsdkDrone(urls[0], start_arena=start_arena, hang_report=hang_report)
        drone.record_to(folder.tlog)

        def observe(moment: Moment) -> None:
            recorder.see(moment)
            judge.see(moment)

        title = f"{scenario.name}: {settings.mission.name}"
        display = FlightDisplay(title, scenario.try_limit_s, recorder, judge)
        showing = asyncio.create_task(display.run())
        try:
            async with open_source(urls[1]) as source:
                camera = RecordingCamera(source, folder.video, scenario.camera.rate_hz)
                files.callback(camera.close)
                return await fly_mission(
                    drone, camera, settings.mission, limit_s=scenario.try_limit_s, observer=observe
                )
        finally:
            showing.cancel()
            await asyncio.gather(showing, return_exceptions=True)


def _say_result(result: dict[str, Any], folder: RunFolder) -> None:
    print(f"{result['verdict']}: {result['reason']}")
    error_m = result["landing_error_m"]
    landing = "did not land" if error_m is None else f"landed {100 * error_m:.1f} cm from the base's centre"
    print(
        f"try {result['try_time_s']:.1f} s, penalty {result['penalty_s']:.1f} s, "
        f"path {result['path_length_m']:.1f} m, {landing}, judged by {result['judged_by']}"
    )
    print(f"left in {folder.path}/", file=sys.stdout, flush=True)
