"""A flight in real time, over MAVLink and video: of a drone that is there, or a simulator started here."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from contextlib import AsyncExitStack
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from framerunner.flying.fly import Flown, fly
from framerunner.flying.plan import FlightPlan
from framerunner.runs.recorder import RecordingCamera, RunRecords
from framerunner.runs.run_folder import warn
from offboard.app import MissionEnd
from scenarios.result import Timing
from vision.types import CameraFrame
from wire.simulator_api import SimulatorApi

if TYPE_CHECKING:  # what is heavy is imported when a flight begins
    from framerunner.flying.mission_teller import MissionTeller
    from framerunner.flying.simulator_process import SimulatorClock, SitlProcess
    from offboard.link.companion import Companion
    from offboard.mavsdk_drone import MavsdkDrone
    from offboard.perception import CameraPerception

SLOW_FACTOR = 0.95  # of the wanted speed; below, vehicle time had to wait


@dataclass(frozen=True, slots=True)
class RealTimeSettings:
    """What is flown in real time.

    Attributes:
        drone_url: MAVLink URL of a drone that is there; None starts a simulator.
        camera_url: of the drone's camera; None with a simulator that is started.
        simulator: what the drone is simulated by, if somebody named it.
        speed: of the simulator that is started: simulated seconds a second.
        instance: of the simulator that is started: shifts its ports.
    """

    drone_url: str | None = None
    camera_url: str | None = None
    simulator: SimulatorApi | None = None
    speed: float = 1.0
    instance: int = 0


@dataclass(frozen=True, slots=True)
class _Endpoints:
    """Where drone, camera and API are.

    Attributes:
        drone_url: of its MAVLink.
        camera_url: of its camera.
        api: of its simulator, or where one may be; None: nowhere.
        image_size_px: width and height, if known before.
        sitl: the simulator that was started for it; None if it was there.
        shared_with: URL of the monitor, if it can hear the drone only through this program.
    """

    drone_url: str
    camera_url: str
    api: SimulatorApi | None
    image_size_px: tuple[int, int] | None
    sitl: SitlProcess | None = None
    shared_with: str | None = None


async def fly_in_real_time(
    plan: FlightPlan, settings: RealTimeSettings, records: RunRecords, monitor_url: str | None
) -> Flown:
    """Fly a plan over MAVLink, with the display in the terminal and all that is recorded.

    Args:
        plan: with a mission.
        settings: what is flown.
        records: keep what the flight shows of itself.
        monitor_url: where the monitor listens for the drone; None: there is none.

    Raises:
        DroneError: the drone cannot be reached or made ready.
        CameraError: the camera gives no image.
        SettingError: the simulator cannot be started, or does not judge this scenario.
    """
    import aiohttp

    from framerunner.flying.display import FlightDisplay
    from framerunner.flying.judges import choose_judge
    from framerunner.flying.mission_teller import MissionTeller
    from offboard.link.companion import Companion
    from offboard.perception import CameraPerception

    async with AsyncExitStack() as stack:
        session = await stack.enter_async_context(aiohttp.ClientSession())
        vehicle = await _vehicle(plan, settings, records, stack, monitor_url)
        named = settings.simulator is not None
        judge, plan = await choose_judge(plan, vehicle.api, session, named=named)
        companion = Companion()
        stack.push_async_callback(companion.close)
        source = records.folder.mission.read_text(encoding="utf-8")
        teller = MissionTeller(companion, plan.chart, source, plan.scenario.name, plan.start_pose)
        drone = _drone(plan, vehicle, records, stack, companion)
        camera = await _camera(plan, vehicle, records, stack, teller)
        eyes = CameraPerception(camera)
        timing = FlightTiming(drone, eyes, None if vehicle.sitl is None else vehicle.sitl.clock)
        title = f"{plan.scenario.name}: {plan.chart.name}"
        display = FlightDisplay(title, plan.limit_s, records.recorder, judge)

        async def run(flight: Coroutine[Any, Any, MissionEnd]) -> MissionEnd:
            async with display:
                task = asyncio.create_task(flight)
                outcome = await (task if vehicle.sitl is None else vehicle.sitl.guard(task))
            camera.close()
            warn(camera.problem)
            return outcome

        flown = await fly(
            plan,
            drone,
            eyes,
            judge,
            (records.see, teller.see),
            run=run,
            measured=lambda: {"timing": timing.report(records.recorder.real_time_factor, settings.speed)},
        )
        await teller.tell_result(records.complete(flown.result))
    return flown


async def _vehicle(
    plan: FlightPlan,
    settings: RealTimeSettings,
    records: RunRecords,
    stack: AsyncExitStack,
    monitor_url: str | None,
) -> _Endpoints:
    """Find the drone that is there, or start a simulator."""
    if settings.drone_url is not None and settings.camera_url is not None:
        api = settings.simulator or SimulatorApi.of_video(settings.camera_url)
        return _Endpoints(settings.drone_url, settings.camera_url, api, None, shared_with=monitor_url)
    from framerunner.flying.simulator_process import SitlProcess

    # The simulator reads the very scenario that was checked here, whatever becomes of its file.
    scenario_file, links = str(records.folder.scenario), () if monitor_url is None else (monitor_url,)
    sitl = await stack.enter_async_context(
        SitlProcess(scenario_file, settings.speed, settings.instance, links)
    )
    camera = plan.scenario.camera
    size_px = (camera.width_px, camera.height_px)
    return _Endpoints(sitl.drone_url, sitl.api.video_url, sitl.api, size_px, sitl)


def _drone(
    plan: FlightPlan,
    vehicle: _Endpoints,
    records: RunRecords,
    stack: AsyncExitStack,
    companion: Companion,
) -> MavsdkDrone:
    """The drone on its link, which is let go of when the stack is left."""
    from offboard.mavsdk_drone import MavsdkDrone

    hang_report = stack.enter_context(records.folder.hang_report.open("w", encoding="utf-8"))
    drone = MavsdkDrone(vehicle.drone_url, start_arena=plan.start_pose, hang_report=hang_report, box=plan.box)
    drone.record_to(records.folder.tlog)
    stack.callback(lambda: warn(drone.recording_problem))
    drone.use_companion(companion)
    if vehicle.sitl is not None:
        drone.use_clock(vehicle.sitl.clock, vehicle.sitl.system_id)
    if vehicle.shared_with is not None:
        drone.share_with(vehicle.shared_with)
    stack.push_async_callback(drone.disconnect)  # not before the result has been told, over its link
    return drone


async def _camera(
    plan: FlightPlan,
    vehicle: _Endpoints,
    records: RunRecords,
    stack: AsyncExitStack,
    teller: MissionTeller,
) -> RecordingCamera:
    """The camera, whose images are recorded; let go of when the stack is left."""
    from vision.sources import open_source

    def keep(frame: CameraFrame) -> None:
        records.see_frame(frame)
        teller.see_frame(frame)

    source = await stack.enter_async_context(open_source(vehicle.camera_url, size_px=vehicle.image_size_px))
    camera = RecordingCamera(source, records.folder.video, plan.scenario.camera.rate_hz, keep)
    stack.callback(camera.close)
    return camera


class FlightTiming:
    """Counts what came late in a real-time flight: whether the machine kept up.

    Args:
        drone: what is flown.
        eyes: through which it sees.
        clock: of a simulator whose time waits for this program; None: vehicle time does not wait.
    """

    def __init__(self, drone: MavsdkDrone, eyes: CameraPerception, clock: SimulatorClock | None) -> None:
        self._drone = drone
        self._eyes = eyes
        self._clock = clock
        if clock is not None:
            clock.look_through(eyes)

    def report(self, real_time_factor: float | None, speed: float) -> Timing:
        """What the flight's result says of it.

        Args:
            real_time_factor: vehicle time a wall time; None before two ticks.
            speed: the wanted one.
        """
        clock = self._clock
        late = {
            "late_ticks": self._drone.late_ticks,
            "late_images": 0 if clock is None else clock.images_missed,
            "late_setpoints": 0 if clock is None else clock.setpoints_missed,
        }
        slow = real_time_factor is not None and real_time_factor < SLOW_FACTOR * speed
        return Timing(
            kept_up=not slow and not any(late.values()),
            vehicle_time_waits=clock is not None,
            speed=speed if real_time_factor is None else real_time_factor / speed,
            **late,
            oldest_image_s=self._eyes.oldest_s,
        )
