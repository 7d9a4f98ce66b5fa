"""A flight in real time, over MAVLink and video: of a running drone, or of a simulator started here."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from contextlib import AbstractAsyncContextManager, AsyncExitStack, nullcontext
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from framerunner.camera_calibration.camera_delay import UNMEASURED, CameraDelay
from framerunner.errors import SettingError
from framerunner.files.text_file import read_text
from framerunner.flying.fly import FinishedFlight, fly
from framerunner.flying.plan import FlightPlan
from framerunner.flying.timing import flight_timing
from framerunner.runs.recorder import RecordingCamera, RunRecords
from framerunner.runs.run_folder import RunFolder, warn
from framerunner.wire.simulator_api import SimulatorApi
from offboard.app import MissionEnd
from offboard.safety.rules import SIMULATED, SafetyRules
from scenarios.result import Timing
from vision.types import CameraFrame

if TYPE_CHECKING:  # these are imported when a flight begins, as they are slow to import
    import aiohttp

    from framerunner.flying.judges import Judge
    from framerunner.flying.mission_reporter import MissionReporter
    from framerunner.flying.simulator_process import GenuineAutopilot, SitlProcess
    from framerunner.preflight.settings import HardwareSettings
    from offboard.link.process_guard import ProcessGuard
    from offboard.mavsdk_drone import MavsdkDrone
    from offboard.perception import Camera, CameraPerception


@dataclass(frozen=True, slots=True)
class RealTimeSettings:
    """What is flown in real time."""

    drone_url: str | None = None  # MAVLink URL of a running drone; None starts a simulator
    camera_url: str | None = None  # of the running drone
    simulator: SimulatorApi | None = None  # of the running drone, if the user named it
    speed: float = 1.0  # of the simulator that is started: simulated seconds a second
    instance: int = 0  # of the simulator that is started: shifts its ports
    autopilot: GenuineAutopilot | None = None  # flies in the simulator that is started; None: our own does
    camera_delay: CameraDelay = UNMEASURED
    hardware: HardwareSettings | None = None  # of a drone that may be a real one; None: it is simulated
    monitor_socket: Path | None = None  # of the monitor that was started here
    unattended: bool = False  # one of many flights: nothing is shown, and there is no video

    @property
    def repeats(self) -> bool:
        """Whether a flight whose time waits for this program depends on nothing else than its seed."""
        return self.autopilot is None or self.autopilot.repeats


@dataclass(frozen=True, slots=True)
class _Endpoints:
    """Where drone, camera and API are."""

    drone_url: str
    camera_url: str
    api: SimulatorApi | None  # of the drone's simulator, or where one may be; None: nowhere
    sitl: SitlProcess | None = None  # the simulator that was started here
    shared_with: str | None = None  # URL of the monitor, if it receives the drone only through this program

    @property
    def has_camera_of_simulator(self) -> bool:
        """Whether the camera's images are those of the simulator at `api`, if there is one."""
        return self.api is not None and self.camera_url == self.api.video_url


async def fly_in_real_time(
    plan: FlightPlan,
    settings: RealTimeSettings,
    records: RunRecords,
    monitor_url: str | None,
    guard: ProcessGuard | None = None,
) -> FinishedFlight:
    """Fly a plan over MAVLink, with the display in the terminal and the records of all ticks and images.

    Args:
        plan: with a mission.
        settings: what is flown.
        records: of the flight.
        monitor_url: where the monitor listens for the drone; None: there is none.
        guard: ends this program when it hangs in flight; None: one that says nothing.

    Raises:
        DroneError: the drone cannot be reached or made ready.
        CameraError: the camera gives no image.
        SettingError: the simulator cannot be started, or does not judge this scenario.
    """
    import aiohttp

    from framerunner.flying.display import FlightDisplay
    from framerunner.flying.mission_reporter import MissionReporter
    from offboard.link.companion import Companion

    async with AsyncExitStack() as stack:
        session = await stack.enter_async_context(aiohttp.ClientSession())
        vehicle = await _vehicle(plan, settings, records, stack, monitor_url)
        judge, plan = await _judge(plan, vehicle, settings, records, session)
        plan, safety, system_id = await _safety(plan, settings, records, stack)
        companion = Companion()
        stack.push_async_callback(companion.close)
        source = read_text(records.folder.mission)
        reporter = MissionReporter(companion, plan.chart, source, plan.scenario.name, plan.start_pose)
        drone = _drone(
            plan, vehicle, records, stack, safety, settings=settings, system_id=system_id, guard=guard
        )
        drone.use_companion(companion)
        camera = await _camera(plan, vehicle, records, stack, reporter, drone=drone, settings=settings)
        perception = _perception(plan, vehicle, judge, camera, drone=drone, delay=settings.camera_delay)
        clock = None if vehicle.sitl is None else vehicle.sitl.clock
        display = FlightDisplay(plan.title, plan.limit_s, records.recorder, judge)
        shown = nullcontext() if settings.unattended else display

        def timing() -> dict[str, Timing]:
            measured = flight_timing(
                drone,
                perception,
                clock,
                factor=records.recorder.real_time_factor,
                speed=settings.speed,
                fused=plan.chart.vision == "frames",
                repeats=settings.repeats and not records.recorder.paused,  # sticks move in wall time
            )
            return {"timing": measured}

        flown = await fly(
            plan,
            drone,
            perception,
            judge,
            observers=(records.see, reporter.see),
            run=partial(_run, shown=shown, camera=camera, vehicle=vehicle, settings=settings),
            measured=timing,
            before_tick=reporter.look,
            safety=safety,
            keep=None if guard is None else records.keep_unfinished,
        )
        await reporter.send_result(records.complete(flown.result))
    return flown


async def _run(
    flight: Coroutine[Any, Any, MissionEnd],
    shown: AbstractAsyncContextManager[object],
    *,
    camera: RecordingCamera,
    vehicle: _Endpoints,
    settings: RealTimeSettings,
) -> MissionEnd:
    """Wait for the flight itself, which is shown meanwhile."""
    async with shown:
        task = asyncio.create_task(flight)
        outcome = await (task if vehicle.sitl is None else vehicle.sitl.guard(task))
    camera.close()
    warn(camera.problem)
    if settings.unattended and vehicle.sitl is not None and vehicle.sitl.clock.gone:
        raise SettingError(vehicle.sitl.clock.gone)  # such a flight is not one of an evaluation
    return outcome


async def _judge(
    plan: FlightPlan,
    vehicle: _Endpoints,
    settings: RealTimeSettings,
    records: RunRecords,
    session: aiohttp.ClientSession,
) -> tuple[Judge, FlightPlan]:
    """The judge, and the plan as the simulator has it, by which the flight is replayed."""
    from framerunner.flying.judges import choose_judge

    judge, changed = await choose_judge(plan, vehicle.api, session, named=settings.simulator is not None)
    if changed.scenario is not plan.scenario:
        records.folder.write_plan(changed.scenario, changed.chart)
    return judge, changed


async def _safety(
    plan: FlightPlan, settings: RealTimeSettings, records: RunRecords, stack: AsyncExitStack
) -> tuple[FlightPlan, SafetyRules, int | None]:
    """Let a drone that may be a real one be checked, and read its operator's keys until the flight's end.

    A drone that says that it is framerunner's simulated one needs neither, nor caps that nobody asked for.
    Only the drone with the MAVLink id that is returned may be flown; None: it is not known.
    """
    hardware, drone_url = settings.hardware, settings.drone_url
    if hardware is None or drone_url is None:
        return plan, SIMULATED, None
    from framerunner.preflight.prepare import own_simulator_id

    if hardware.asks_nothing:
        simulated_id = await own_simulator_id(drone_url, settings.camera_url)
        if simulated_id is not None:
            return replace(plan, caps=plan.caps if hardware.capped else None), SIMULATED, simulated_id
    from framerunner.preflight.keys import TerminalKeys, has_terminal
    from framerunner.preflight.operator_link import OperatorLink
    from framerunner.preflight.prepare import new_operator, prepare
    from framerunner.preflight.run import PreflightSettings

    socket = hardware.operator_socket or settings.monitor_socket
    operator = new_operator(hardware, has_page=socket is not None)
    link = None
    if socket is not None:
        title = f"{plan.title}, {'dry run' if hardware.dry_run else 'flight'}"
        link = OperatorLink(socket, operator, title, terminal=has_terminal() or operator.has_go)
        await stack.enter_async_context(link)
    checks = PreflightSettings(
        drone_url,
        settings.camera_url,
        settings.camera_delay,
        set_parameters=hardware.set_parameters,
        accepted=hardware.accepted,
        folder=records.folder.path,
        abort=hardware.abort,
    )
    show = {} if link is None else {"show": link.show_card}
    safety, system_id = await prepare(plan, checks, hardware, operator, **show)
    await stack.enter_async_context(TerminalKeys(operator))
    return plan, safety, system_id


async def _vehicle(
    plan: FlightPlan,
    settings: RealTimeSettings,
    records: RunRecords,
    stack: AsyncExitStack,
    monitor_url: str | None,
) -> _Endpoints:
    """Those of the running drone, or of a simulator that is started."""
    if settings.drone_url is not None and settings.camera_url is not None:
        api = settings.simulator or SimulatorApi.of_video(settings.camera_url)
        return _Endpoints(settings.drone_url, settings.camera_url, api, shared_with=monitor_url)
    from framerunner.flying.simulator_process import SitlProcess

    # The simulator reads the scenario that was checked here, even if the user's file changes.
    scenario_file, autopilot = str(records.folder.scenario), settings.autopilot
    links = () if monitor_url is None or autopilot is not None else (monitor_url,)  # others have their own
    storage = None if autopilot is None else records.folder.path
    started = SitlProcess(
        scenario_file,
        speed=settings.speed,
        instance=settings.instance,
        links=links,
        seed=plan.seed or 0,
        autopilot=autopilot,
        storage=storage,
        on_warning=(lambda line: None) if settings.unattended else warn,
    )
    sitl = await stack.enter_async_context(started)
    shared = None if autopilot is None else monitor_url
    return _Endpoints(sitl.drone_url, sitl.api.video_url, sitl.api, sitl, shared_with=shared)


def _drone(
    plan: FlightPlan,
    vehicle: _Endpoints,
    records: RunRecords,
    stack: AsyncExitStack,
    safety: SafetyRules,
    *,
    settings: RealTimeSettings,
    system_id: int | None,
    guard: ProcessGuard | None,
) -> MavsdkDrone:
    """The drone on its link, which is closed with the stack; in a dry run it is never armed."""
    from offboard.dry_run import DryRunDrone
    from offboard.mavsdk_drone import MavsdkDrone

    dry_run = settings.hardware is not None and settings.hardware.dry_run
    drone = (DryRunDrone if dry_run else MavsdkDrone)(
        vehicle.drone_url,
        start_arena=plan.start_pose,
        guard=guard,
        limits=plan.velocity_limits(),
        corrects=plan.corrects_commands,
        system_id=system_id,
        when_hung=safety.abort,
    )
    drone.record_to(records.folder.tlog)
    stack.callback(lambda: warn(drone.recording_problem))
    if vehicle.sitl is not None:
        drone.use_clock(vehicle.sitl.clock, vehicle.sitl.system_id)
    if vehicle.shared_with is not None:
        drone.share_with(vehicle.shared_with)
    stack.push_async_callback(drone.disconnect)  # not before the result has been sent over its link
    return drone


def flight_guard(settings: RealTimeSettings, folder: RunFolder) -> ProcessGuard:
    """Ends this program when it hangs while it commands a drone, and keeps the result however it ends."""
    from offboard.link.process_guard import ProcessGuard
    from offboard.link.watchdog import LIMITS, PATIENT_LIMITS

    limits, then = LIMITS, "the drone gets no more setpoints and acts by its failsafe; if not, take control"
    if settings.drone_url is None:
        limits, then = PATIENT_LIMITS, "its simulator ends with it"
    kept, trace = f"what was flown is in {folder.result}", folder.hang_report
    where = f"where it hung is in {trace}"
    return ProcessGuard(
        hung=f"error: the app hung for {limits.locked_s:g} s and was ended: {then}; {where}, {kept}",
        ended=f"error: the app was ended, so its keys have no effect: {then}; {kept}",
        trace=trace,
        unfinished=folder.unfinished,
        result=folder.result,
    )


async def _camera(
    plan: FlightPlan,
    vehicle: _Endpoints,
    records: RunRecords,
    stack: AsyncExitStack,
    reporter: MissionReporter,
    *,
    drone: MavsdkDrone,
    settings: RealTimeSettings,
) -> RecordingCamera:
    """The camera, whose images are recorded; closed with the stack."""
    from vision.sources import open_source

    def keep(frame: CameraFrame) -> None:
        # Without a time of its own it is recorded at that of its arrival, which is between two ticks.
        time_us = drone.vehicle_time_us(frame.received_s) if frame.time_us is None else frame.time_us
        records.see_frame(replace(frame, time_us=time_us))
        reporter.see_frame(frame)

    source: Camera
    if vehicle.sitl is not None:
        source = vehicle.sitl.clock.images
    else:
        opened = open_source(vehicle.camera_url, reconnects=True)
        source = await stack.enter_async_context(opened)
    path = None if settings.unattended else records.folder.video
    camera = RecordingCamera(source, path, plan.scenario.camera.rate_hz, keep)
    stack.callback(camera.close)
    return camera


def _perception(
    plan: FlightPlan,
    vehicle: _Endpoints,
    judge: Judge,
    camera: RecordingCamera,
    *,
    drone: MavsdkDrone,
    delay: CameraDelay,
) -> CameraPerception:
    """What the mission sees through the camera."""
    from framerunner.flying.detector import plan_detector
    from framerunner.flying.judges import TruthJudge
    from offboard.perception import CameraPerception

    rendered = isinstance(judge, TruthJudge) and vehicle.has_camera_of_simulator
    perception = CameraPerception(
        camera, plan_detector(plan, rendered=rendered), patient=vehicle.sitl is not None
    )
    perception.assume_times(drone.vehicle_time_us, delay.age_s)
    if vehicle.sitl is not None:
        vehicle.sitl.clock.wait_for_images_of(perception)
    return perception
