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
from framerunner.runs.recorder import RecordingCamera, RunRecords
from framerunner.runs.run_folder import RunFolder
from framerunner.terminal import warn
from framerunner.wire.simulator_api import SimulatorApi
from offboard.app import MissionEnd
from offboard.safety.rules import SIMULATED, SafetyRules
from scenarios.result import Timing
from vision.types import CameraFrame

if TYPE_CHECKING:  # these are imported when a flight begins, as they are slow to import
    import aiohttp

    from framerunner.flying.judges import Judge
    from framerunner.flying.mission_reporter import MissionReporter
    from framerunner.flying.simulator_process import GenuineAutopilot, SimulatorClock, SitlProcess
    from framerunner.preflight.settings import HardwareSettings
    from offboard.link.process_guard import ProcessGuard
    from offboard.mavsdk_drone import MavsdkDrone
    from offboard.perception import CameraPerception, ImageSource

SLOW_FACTOR = 0.95  # of the requested speed; below, vehicle time had to wait


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
    async with AsyncExitStack() as stack:
        return await _RealTimeFlight(plan, settings, records, stack).fly(monitor_url, guard)


class _RealTimeFlight:
    """One flight over MAVLink; what it opens is closed with the stack. See `fly_in_real_time`."""

    def __init__(
        self, plan: FlightPlan, settings: RealTimeSettings, records: RunRecords, stack: AsyncExitStack
    ) -> None:
        self._plan = plan
        self._settings = settings
        self._records = records
        self._stack = stack
        self._vehicle: _Endpoints
        self._drone: MavsdkDrone

    async def fly(self, monitor_url: str | None, guard: ProcessGuard | None) -> FinishedFlight:
        import aiohttp

        from framerunner.flying.display import FlightDisplay
        from framerunner.flying.mission_reporter import MissionReporter
        from offboard.link.companion import Companion

        session = await self._stack.enter_async_context(aiohttp.ClientSession())
        records, settings = self._records, self._settings
        self._vehicle = await self._find_vehicle(monitor_url)
        judge = await self._choose_judge(session)
        safety, system_id = await self._check()
        plan, companion = self._plan, Companion()
        self._stack.push_async_callback(companion.close)
        source = read_text(records.folder.mission)
        reporter = MissionReporter(companion, plan.chart, source, plan.scenario.name, plan.start_pose)
        self._drone = self._new_drone(safety, system_id, guard)
        self._drone.use_companion(companion)
        camera = await self._open_camera(reporter)
        perception = self._new_perception(camera)
        display = FlightDisplay(plan.title, plan.limit_s, records.recorder, judge)
        flown = await fly(
            plan,
            self._drone,
            perception,
            judge,
            observers=(records.see, reporter.see),
            run=partial(self._run, camera=camera, shown=nullcontext() if settings.unattended else display),
            measured=lambda: {"timing": self._timing(perception)},
            before_tick=reporter.look,
            safety=safety,
            keep=None if guard is None else records.keep_unfinished,
        )
        await reporter.send_result(records.complete(flown.result))
        return flown

    async def _run(
        self,
        flight: Coroutine[Any, Any, MissionEnd],
        *,
        camera: RecordingCamera,
        shown: AbstractAsyncContextManager[object],
    ) -> MissionEnd:
        """Wait for the flight itself, which is shown meanwhile."""
        sitl = self._vehicle.sitl
        async with shown:
            task = asyncio.create_task(flight)
            outcome = await (task if sitl is None else sitl.guard(task))
        camera.close()
        warn(camera.problem)
        if self._settings.unattended and sitl is not None and sitl.clock.gone:
            raise SettingError(sitl.clock.gone)  # such a flight is not one of an evaluation
        return outcome

    def _timing(self, perception: CameraPerception) -> Timing:
        """Whether the machine kept up."""
        recorder = self._records.recorder
        return flight_timing(
            self._drone,
            perception,
            None if self._vehicle.sitl is None else self._vehicle.sitl.clock,
            factor=recorder.real_time_factor,
            speed=self._settings.speed,
            fused=self._plan.chart.vision == "frames",
            repeats=self._settings.repeats and not recorder.paused,  # sticks move in wall time
        )

    async def _find_vehicle(self, monitor_url: str | None) -> _Endpoints:
        """Those of the running drone, or of a simulator that is started."""
        settings, records = self._settings, self._records
        if settings.drone_url is not None and settings.camera_url is not None:
            api = settings.simulator or SimulatorApi.of_video(settings.camera_url)
            return _Endpoints(settings.drone_url, settings.camera_url, api, shared_with=monitor_url)
        from framerunner.flying.simulator_process import SitlProcess

        autopilot = settings.autopilot
        started = SitlProcess(
            # The simulator reads the scenario that was checked here, even if the user's file changes.
            str(records.folder.scenario),
            speed=settings.speed,
            instance=settings.instance,
            links=() if monitor_url is None or autopilot is not None else (monitor_url,),  # others: their own
            seed=self._plan.seed or 0,
            autopilot=autopilot,
            storage=None if autopilot is None else records.folder.path,
            on_warning=(lambda line: None) if settings.unattended else warn,
        )
        sitl = await self._stack.enter_async_context(started)
        shared = None if autopilot is None else monitor_url
        return _Endpoints(sitl.drone_url, sitl.api.video_url, sitl.api, sitl, shared_with=shared)

    async def _choose_judge(self, session: aiohttp.ClientSession) -> Judge:
        """The judge; the plan becomes as the simulator has it, by which the flight is replayed."""
        from framerunner.flying.judges import choose_judge

        named = self._settings.simulator is not None
        judge, changed = await choose_judge(self._plan, self._vehicle.api, session, named=named)
        if changed.scenario is not self._plan.scenario:
            self._records.folder.write_plan(changed.scenario, changed.chart)
        self._plan = changed
        return judge

    async def _check(self) -> tuple[SafetyRules, int | None]:
        """Let a drone that may be a real one be checked, and read its operator's keys until the flight's end.

        A drone that says that it is framerunner's simulated one needs neither, nor caps that nobody asked
        for. Only the drone with the MAVLink id that is returned may be flown; None: it is not known.
        """
        plan, settings = self._plan, self._settings
        hardware, drone_url = settings.hardware, settings.drone_url
        if hardware is None or drone_url is None:
            return SIMULATED, None
        from framerunner.preflight.prepare import own_simulator_id

        if hardware.asks_nothing:
            simulated_id = await own_simulator_id(drone_url, settings.camera_url)
            if simulated_id is not None:
                self._plan = replace(plan, caps=plan.caps if hardware.capped else None)
                return SIMULATED, simulated_id
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
            await self._stack.enter_async_context(link)
        checks = PreflightSettings(
            drone_url,
            settings.camera_url,
            settings.camera_delay,
            set_parameters=hardware.set_parameters,
            accepted=hardware.accept,
            folder=self._records.folder.path,
            abort=hardware.on_abort,
        )
        show = {} if link is None else {"show": link.show_card}
        safety, system_id = await prepare(plan, checks, hardware, operator, **show)
        await self._stack.enter_async_context(TerminalKeys(operator))
        return safety, system_id

    def _new_drone(
        self, safety: SafetyRules, system_id: int | None, guard: ProcessGuard | None
    ) -> MavsdkDrone:
        """The drone on its link; in a dry run it is never armed."""
        from offboard.dry_run import DryRunDrone
        from offboard.mavsdk_drone import MavsdkDrone

        plan, vehicle, hardware = self._plan, self._vehicle, self._settings.hardware
        dry_run = hardware is not None and hardware.dry_run
        drone = (DryRunDrone if dry_run else MavsdkDrone)(
            vehicle.drone_url,
            start_arena=plan.start_pose,
            guard=guard,
            limits=plan.velocity_limits(),
            corrects=plan.corrects_commands,
            system_id=system_id,
            when_hung=safety.abort,
            reports_place=plan.alone,
        )
        drone.record_to(self._records.folder.tlog)
        self._stack.callback(lambda: warn(drone.recording_problem))
        if vehicle.sitl is not None:
            drone.use_clock(vehicle.sitl.clock, vehicle.sitl.system_id)
        if vehicle.shared_with is not None:
            drone.share_with(vehicle.shared_with)
        self._stack.push_async_callback(drone.disconnect)  # not before the result has been sent over its link
        return drone

    async def _open_camera(self, reporter: MissionReporter) -> RecordingCamera:
        """The camera, whose images are recorded."""
        from vision.sources import open_source

        def keep(frame: CameraFrame) -> None:
            # Without a time of its own it is recorded at that of its arrival, which is between two ticks.
            time_us = (
                self._drone.vehicle_time_us(frame.received_s) if frame.time_us is None else frame.time_us
            )
            self._records.see_frame(replace(frame, time_us=time_us))
            reporter.see_frame(frame)

        source: ImageSource
        if self._vehicle.sitl is not None:
            source = self._vehicle.sitl.clock.images
        else:
            opened = open_source(self._vehicle.camera_url, reconnects=True)
            source = await self._stack.enter_async_context(opened)
        path = None if self._settings.unattended else self._records.folder.video
        camera = RecordingCamera(source, path, self._plan.scenario.camera.rate_hz, keep)
        self._stack.callback(camera.close)
        return camera

    def _new_perception(self, camera: RecordingCamera) -> CameraPerception:
        """What the mission sees through the camera."""
        from framerunner.flying.detector import plan_detector
        from offboard.perception import CameraPerception

        sitl = self._vehicle.sitl
        perception = CameraPerception(camera, plan_detector(self._plan), patient=sitl is not None)
        perception.assume_times(self._drone.vehicle_time_us, self._settings.camera_delay.age_s)
        if sitl is not None:
            sitl.clock.wait_for_images_of(perception)
        return perception


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


def flight_timing(
    drone: MavsdkDrone,
    perception: CameraPerception,
    clock: SimulatorClock | None,
    factor: float | None,
    speed: float,
    *,
    fused: bool,
    repeats: bool = True,
) -> Timing:
    """What was late, and so whether the machine was fast enough for the requested speed.

    Args:
        drone: that was flown.
        perception: through which it saw.
        clock: of a simulator whose time waits for this program; None: vehicle time does not wait.
        factor: vehicle time per wall time; None before two ticks.
        speed: the requested factor.
        fused: the mission's navigator uses images by their time stamps.
        repeats: of a vehicle whose time waits, the flight depends on nothing else than its seed.
    """
    ticks, late = drone.ticks_in_flight
    slow = factor is not None and factor < SLOW_FACTOR * speed
    images = 0 if clock is None else clock.images_missed
    setpoints = 0 if clock is None else clock.setpoints_missed
    timing = Timing(
        kept_up=not (slow or late or images or setpoints),
        vehicle_time_waits=clock is not None,
        speed=speed if factor is None else factor / speed,
        ticks=ticks,
        late_ticks=late,
        late_share=late / max(ticks, 1),
        late_images=images,
        late_setpoints=setpoints,
        oldest_image_s=perception.oldest_s,
    )
    return timing.model_copy(update={"words": in_words(timing, fused=fused, repeats=repeats)})


def in_words(timing: Timing, *, fused: bool, repeats: bool) -> str:
    """One line for people if the machine was too slow; empty if it was not. See `flight_timing`."""
    if timing.kept_up:
        return ""
    late = []
    if timing.late_ticks:
        late.append(f"{100 * timing.late_share:.1f} % of ticks were late")
    for count, what in ((timing.late_images, "image"), (timing.late_setpoints, "setpoint")):
        if count:
            late.append(f"{count} {what}{'s' if count > 1 else ''} came late")
    if late:
        oldest = f"the oldest image was {timing.oldest_image_s:.2f} s old"
        still = "was still fused by time stamps" if fused else "may differ from one on a free machine"
        return f"the machine did not keep up: {', '.join(late)}, {oldest}; the flight {still}"
    pace = f"the machine did not keep up: vehicle time ran at {timing.speed:.2f} of the requested speed"
    if timing.vehicle_time_waits and repeats:
        return f"{pace}; it waited for the app, so the flight is the same as on a free machine"
    if timing.vehicle_time_waits:
        return f"{pace}; it waited for the app, but the flight may differ from one on a free machine"
    return f"{pace}; nothing came late to the app"
