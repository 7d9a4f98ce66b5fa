"""`framerunner fly`: one flight with all the files it writes, in real time or in lockstep."""

from __future__ import annotations

import asyncio
from contextlib import AbstractContextManager, closing, nullcontext
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from framerunner.errors import UserError
from framerunner.flying.display import LockstepProgress, dry_run_line, result_lines
from framerunner.flying.fly import FinishedFlight
from framerunner.flying.output import OutputSettings
from framerunner.flying.plan import FlightPlan
from framerunner.flying.real_time import RealTimeSettings, flight_guard, fly_in_real_time
from framerunner.runs.recorder import RunRecords, VideoFile
from framerunner.runs.run_folder import RunFolder, left_lines, write_outcome
from framerunner.terminal import warn
from framerunner.wire.simulator_api import SimulatorApi
from offboard.app import INTERRUPTED
from vision.types import Image

if TYPE_CHECKING:
    from framerunner.recording.mcap_writer import FlightRecording
    from offboard.link.process_guard import ProcessGuard

_INTERRUPTED_CODE = 130
_NOT_KEPT_CODE = 2  # there is a warning why


@dataclass(frozen=True, slots=True)
class FlightSettings:
    """What to fly and what to write."""

    plan: FlightPlan  # with a mission
    real_time: RealTimeSettings | None  # None: simulated in this process, in lockstep
    output: OutputSettings


async def fly_once(settings: FlightSettings) -> int:
    """Fly, judge, write.

    Returns:
        0 if completed, 1 if flown but not completed, 2 if the result could not be written, 130 after Ctrl-C.

    Raises:
        DroneError: the drone cannot be reached or made ready.
        CameraError: the camera gives no image.
        SettingError: the simulator or the monitor cannot be started.
    """
    if settings.real_time is None or not settings.output.monitor:
        return await _fly_and_judge(settings, settings.output.monitor_link)
    from framerunner.child_process import MonitorProcess

    # The simulator that is started has a referee; a running drone may have none.
    judges, hosts = settings.real_time.drone_url is not None, _camera_hosts(settings.real_time)
    async with MonitorProcess(settings.plan.scenario, settings.output.out, hosts, judges=judges) as monitor:
        await monitor.opened()
        if settings.output.wait_for_viewer:
            await monitor.viewed()
        real_time = replace(settings.real_time, monitor_socket=monitor.operator_socket)
        code = await _fly_and_judge(replace(settings, real_time=real_time), monitor.link)
        if code != _INTERRUPTED_CODE:
            await monitor.stay()
    return code


def _camera_hosts(settings: RealTimeSettings) -> tuple[str, ...]:
    """Hosts that the user named, which the monitor may use too."""
    named = (SimulatorApi.of_video(settings.camera_url or ""), settings.simulator)
    hosts = (urlsplit(api.url).hostname for api in named if api is not None)
    return tuple(dict.fromkeys(host for host in hosts if host))


async def _fly_and_judge(settings: FlightSettings, monitor_url: str | None) -> int:
    plan = settings.plan
    folder = RunFolder(settings.output.out, plan.scenario.name)
    try:
        folder.write_plan(plan.scenario, plan.chart)
        if plan.calibration is not None:
            from framerunner.camera_calibration.calibration_file import save_calibration

            save_calibration(plan.calibration, folder.calibration)
        with _guard(settings, folder) as guard, _recording(settings, folder) as recording:
            records = RunRecords(folder, recording)
            try:
                if settings.real_time is None:
                    flown = await _fly_in_lockstep(settings, records)
                else:
                    flown = await fly_in_real_time(plan, settings.real_time, records, monitor_url, guard)
            except BaseException as error:
                records.stop_keeping()
                interrupted = isinstance(error, asyncio.CancelledError | KeyboardInterrupt)
                folder.stopped_before_start = interrupted and records.recorder.latest is None
                if guard is not None and guard.is_used and folder.end_unfinished(_why(error)):
                    warn(f"the flight was not ended in order; {folder.result} has what was flown until then")
                raise
            records.stop_keeping()
            result = records.complete(flown.result)
            is_kept = write_outcome(folder, flown.layout, flown.track, result)
            records.finish(flown.result, flown.track)
        if recording is not None:
            warn(recording.problem)
    finally:
        folder.remove_if_empty()
    late = "" if result.timing is None else result.timing.words
    hardware = None if settings.real_time is None else settings.real_time.hardware
    is_dry = hardware is not None and hardware.dry_run
    told = dry_run_line(flown.outcome) if is_dry else result_lines(result)
    lines = [told, *([late] if late else []), *left_lines(folder, result)]
    print("\n".join(lines), flush=True)
    if flown.outcome.interrupted:
        return _INTERRUPTED_CODE
    if not is_kept:
        return _NOT_KEPT_CODE
    if is_dry:
        return 1 if flown.outcome.ended == "aborted" else 0
    return 0 if result.completed else 1


def _guard(settings: FlightSettings, folder: RunFolder) -> AbstractContextManager[ProcessGuard | None]:
    if settings.real_time is None:
        return nullcontext()
    return flight_guard(settings.real_time, folder)


def _why(error: BaseException) -> str:
    """Why a flight ended for which the program was not made."""
    if isinstance(error, asyncio.CancelledError | KeyboardInterrupt):
        return INTERRUPTED
    return (
        str(error) if isinstance(error, UserError) else f"unexpected error: {type(error).__name__}: {error}"
    )


def _recording(settings: FlightSettings, folder: RunFolder) -> AbstractContextManager[FlightRecording | None]:
    if not settings.output.record:
        return nullcontext()
    from framerunner.recording.mcap_writer import FlightRecording

    plan = settings.plan
    return FlightRecording(folder.recording, plan.scenario, plan.chart, plan.seed)


async def _fly_in_lockstep(settings: FlightSettings, records: RunRecords) -> FinishedFlight:
    from framerunner.flying.lockstep import lockstep_flight

    plan = settings.plan
    video = VideoFile(records.folder.video, plan.scenario.camera.rate_hz)
    with closing(video), LockstepProgress(plan.limit_s) as progress:

        def keep(time_us: int, image: Image) -> None:
            if settings.output.video:
                video.write(image)
            records.see_image(time_us, image)

        flown = await lockstep_flight(plan, observers=(records.see, progress.see), on_image=keep)
    warn(video.problem)
    return flown
