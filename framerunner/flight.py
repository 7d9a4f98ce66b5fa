"""One flight from start to verdict, with everything it leaves behind."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import AsyncExitStack, closing, contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from firmware_py.airframe import load_airframe
from framerunner.flight_files import left_lines, warn, write_outcome
from framerunner.flight_result import flight_result, result_lines, timing_line
from framerunner.flight_timing import FlightTiming
from framerunner.lockstep import Flown, lockstep_flight
from framerunner.lockstep_progress import LockstepProgress
from framerunner.recorder import FlightRecorder, RecordingCamera, VideoFile
from framerunner.run_folder import RunFolder
from framerunner.virtual_camera.lift import lifted
from offboard.app import MissionEnd, Moment, fly_mission
from offboard.keep_in_box import Box, flight_box
from offboard.mission import Mission
from scenarios.ground import start_position
from scenarios.models import Scenario
from scenarios.result import FlightResult
from vision.types import CameraFrame, Image

if TYPE_CHECKING:  # what only flights in real time need is imported when one is flown
    from framerunner.judges import Judge
    from framerunner.mission_teller import MissionTeller
    from framerunner.recording.mcap_writer import FlightRecording
    from framerunner.sitl_process import SitlProcess
    from offboard.mavsdk_drone import MavsdkDrone

_INTERRUPTED_CODE = 130


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
        seed: of everything random in a lockstep flight.
        record: write everything to an MCAP file, too.
        video: write what the camera saw in lockstep, too.
        monitor: open the Game Monitor for it.
    """

    scenario: Scenario
    mission: Mission
    drone_url: str | None
    camera_url: str | None
    speed: float
    instance: int
    out: Path
    lockstep: bool = False
    seed: int = 0
    record: bool = False
    video: bool = False
    monitor: bool = False


class _Records:
    """Everything that keeps what a flight shows of itself.

    Attributes:
        folder: where it is kept.
        recorder: the track.
        recording: the MCAP file; None without `--record`.
    """

    def __init__(self, folder: RunFolder, recording: FlightRecording | None) -> None:
        self._started = datetime.now(UTC)
        self.folder = folder
        self.recorder = FlightRecorder()
        self.recording = recording

    def see(self, moment: Moment) -> None:
        """Take a tick."""
        self.recorder.see(moment)
        if self.recording is not None:
            self.recording.see(moment)

    def see_image(self, time_us: int, image: Image) -> None:
        """Take a raw image, of the simulated camera."""
        if self.recording is not None:
            self.recording.see_image(time_us, image)

    def see_frame(self, frame: CameraFrame) -> None:
        """Take an image of a camera source."""
        if self.recording is not None:
            self.recording.see_frame(frame)

    def complete(self, result: FlightResult) -> FlightResult:
        """What stands in `result.json`: a result with what tells of wall time."""
        wall = {
            "wall_time_s": self.recorder.wall_time_s,
            "real_time_factor": self.recorder.real_time_factor,
            "started": self._started.isoformat(timespec="seconds"),
        }
        return result.model_copy(update=wall)

    def finish(self, flown: Flown) -> None:
        """Add what is known only after the flight."""
        if self.recording is not None:
            self.recording.finish(flown.result, flown.track.time_s)


async def fly_once(settings: FlightSettings) -> int:
    """Fly, judge, write.

    Returns:
        0 completed, 1 flown but not completed, 130 stopped with Ctrl-C.

    Raises:
        DroneError: the drone cannot be reached or made ready.
        CameraError: the camera gives no image.
        SettingError: the simulator or the monitor cannot be started.
    """
    if not settings.monitor:
        return await _fly_and_judge(settings, None)
    from framerunner.monitor_process import MonitorProcess

    # A drone of one's own brings no referee; the simulator does.
    scenario = None if settings.drone_url is None else settings.scenario
    async with MonitorProcess(scenario, settings.out, _camera_hosts(settings.camera_url)) as monitor:
        await monitor.opened()
        code = await _fly_and_judge(settings, monitor.link)
        if code != _INTERRUPTED_CODE:
            await monitor.stay()
    return code


def _camera_hosts(camera_url: str | None) -> tuple[str, ...]:
    """The host that the user named as the camera's: the monitor, too, may ask there."""
    try:
        parts = urlsplit(camera_url or "")
        host = parts.hostname
    except ValueError:
        return ()
    return (host,) if host and parts.scheme in ("http", "https") else ()


async def _fly_and_judge(settings: FlightSettings, guest_url: str | None) -> int:
    with _run_folder(settings) as folder:
        with _recording(settings, folder) as recording:
            records = _Records(folder, recording)
            try:
                if settings.lockstep:
                    flown = await _fly_in_lockstep(settings, records)
                else:
                    flown = await _fly_in_real_time(settings, records, guest_url)
            except (asyncio.CancelledError, KeyboardInterrupt):
                folder.stopped_before_start = records.recorder.latest is None
                raise
            records.finish(flown)
        result = records.complete(flown.result)
        scenario = lifted(settings.scenario, result.lift_m)
        write_outcome(folder, scenario, flown.track, result)
    late = timing_line(result.timing)
    lines = [result_lines(result), *([late] if late else []), *left_lines(folder, result)]
    print("\n".join(lines), flush=True)
    if flown.outcome.interrupted:
        return _INTERRUPTED_CODE
    return 0 if result.completed else 1


async def _fly_in_lockstep(settings: FlightSettings, records: _Records) -> Flown:
    scenario = settings.scenario
    video = VideoFile(records.folder.video, scenario.camera.rate_hz)  # made with its first image
    with closing(video), LockstepProgress(scenario.try_limit_s) as progress:

        def observe(moment: Moment) -> None:
            records.see(moment)
            progress.see(moment)

        def keep(time_us: int, image: Image) -> None:
            if settings.video:
                video.write(image)
            records.see_image(time_us, image)

        flown = await lockstep_flight(
            scenario, settings.mission, seed=settings.seed, observer=observe, on_image=keep
        )
    warn(video.problem)
    return flown


async def _fly_in_real_time(settings: FlightSettings, records: _Records, guest_url: str | None) -> Flown:
    import aiohttp

    from framerunner.judges import choose_judge
    from framerunner.mission_teller import MissionTeller
    from offboard.link.companion import Companion
    from offboard.mavsdk_drone import MavsdkDrone

    scenario, folder = settings.scenario, records.folder
    async with AsyncExitStack() as stack:
        session = await stack.enter_async_context(aiohttp.ClientSession())
        drone_url, camera_url, sitl = await _vehicle(settings, folder, stack, guest_url)
        judge = await choose_judge(scenario, camera_url, session)
        companion = Companion()
        stack.push_async_callback(companion.close)
        start_arena = _start(scenario)
        source = folder.mission.read_text(encoding="utf-8")
        teller = MissionTeller(companion, settings.mission, source, scenario.name, start_arena)
        hang_report = stack.enter_context(folder.hang_report.open("w", encoding="utf-8"))
        box = flight_box(scenario, judge.lift_m)
        drone = MavsdkDrone(drone_url, start_arena=start_arena, hang_report=hang_report, box=box)
        drone.record_to(folder.tlog)
        stack.callback(lambda: warn(drone.recording_problem))
        drone.tell_through(companion)
        if sitl is not None:
            drone.wait_with(sitl.clock, sitl.system_id)
        if guest_url is not None and sitl is None:
            drone.share_with(guest_url)
        stack.push_async_callback(drone.let_go)  # not before the result has been told, over its link
        timing = FlightTiming(drone, None if sitl is None else sitl.clock)
        flight = asyncio.create_task(
            _fly(settings, records, judge, teller, timing, drone=drone, camera_url=camera_url, box=box)
        )
        outcome = await (flight if sitl is None else sitl.guard(flight))
        ended = None if outcome.ended == "finished" else outcome.reason
        report = await judge.report(outcome.mission_state, ended)
        standing = await judge.standing()
        track = records.recorder.track(standing.began_us if standing else None)
        result = flight_result(
            scenario,
            settings.mission,
            report,
            outcome,
            track,
            judged_by=judge.source,
            lift_m=judge.lift_m,
            timing=timing.report(records.recorder.real_time_factor, settings.speed),
        )
        await teller.tell_result(records.complete(result))
    return Flown(result, outcome, track)


def _camera_size(settings: FlightSettings) -> tuple[int, int] | None:
    """Width and height of the camera's images, pixels; None for a camera of one's own."""
    if settings.drone_url is not None and settings.camera_url is not None:
        return None
    camera = settings.scenario.camera
    return camera.width_px, camera.height_px


def _start(scenario: Scenario) -> tuple[float, float, float, float]:
    """Where the drone's centre stands at first: x, y, z (metres) and yaw (radians), arena axes."""
    x_m, y_m, z_m = start_position(scenario)
    height_m = load_airframe(scenario.airframe).envelope_m[2]
    return (x_m, y_m, z_m + height_m / 2, scenario.start.yaw_rad)


@contextmanager
def _run_folder(settings: FlightSettings) -> Iterator[RunFolder]:
    """Make the folder; take it away again if the flight did not begin and left nothing."""
    folder = RunFolder(settings.out, settings.scenario.name)
    try:
        folder.write_plan(settings.scenario, settings.mission)
        yield folder
    finally:
        folder.remove_if_empty()


@contextmanager
def _recording(settings: FlightSettings, folder: RunFolder) -> Iterator[FlightRecording | None]:
    """Open the recording, if one is wanted, and close it whatever happens."""
    if not settings.record:
        yield None
        return
    from framerunner.recording.mcap_writer import FlightRecording

    seed = settings.seed if settings.lockstep else None
    with FlightRecording(folder.recording, settings.scenario, settings.mission, seed) as recording:
        yield recording
    warn(recording.problem)


async def _vehicle(
    settings: FlightSettings,
    folder: RunFolder,
    stack: AsyncExitStack,
    guest_url: str | None,
) -> tuple[str, str, SitlProcess | None]:
    """Return the drone's and the camera's URL, and the simulator if one was started."""
    if settings.drone_url is not None and settings.camera_url is not None:
        return settings.drone_url, settings.camera_url, None
    from framerunner.sitl_process import SitlProcess

    # The simulator reads the very scenario that was checked here, whatever becomes of its file.
    sitl = await stack.enter_async_context(
        SitlProcess(
            str(folder.scenario), settings.speed, settings.instance, () if guest_url is None else (guest_url,)
        )
    )
    return sitl.drone_url, sitl.video_url, sitl


async def _fly(
    settings: FlightSettings,
    records: _Records,
    judge: Judge,
    teller: MissionTeller,
    timing: FlightTiming,
    *,
    drone: MavsdkDrone,
    camera_url: str,
    box: Box,
) -> MissionEnd:
    from framerunner.display import FlightDisplay
    from offboard.eyes import CameraEyes
    from vision.sources import open_source

    scenario = settings.scenario

    def observe(moment: Moment) -> None:
        records.see(moment)
        judge.see(moment)
        teller.see(moment)

    def keep(frame: CameraFrame) -> None:
        records.see_frame(frame)
        teller.see_frame(frame)

    title = f"{scenario.name}: {settings.mission.name}"
    display = FlightDisplay(title, scenario.try_limit_s, records.recorder, judge)
    showing = asyncio.create_task(display.run())
    try:
        async with open_source(camera_url, size_px=_camera_size(settings)) as source:
            camera = RecordingCamera(source, records.folder.video, scenario.camera.rate_hz, keep)
            eyes = CameraEyes(camera)
            timing.look_through(eyes)
            with closing(camera):
                outcome = await fly_mission(
                    drone,
                    None,
                    settings.mission,
                    limit_s=scenario.try_limit_s,
                    observer=observe,
                    eyes=eyes,
                    box=box,
                )
            warn(camera.problem)
            return outcome
    finally:
        showing.cancel()
        await asyncio.gather(showing, return_exceptions=True)
