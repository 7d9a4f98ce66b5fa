"""`framerunner fly`: a mission from take-off to verdict."""

from __future__ import annotations

import asyncio
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from framerunner.camera_calibration.camera_delay import delay_of
from framerunner.commands import (
    DEFAULT_MISSION,
    Faults,
    NamedPilot,
    Sensors,
    WholeNumber,
    check_range,
    for_genuine,
    say,
    with_faults,
    with_sensors,
)
from framerunner.commands.options.hardware import NONE, HardwareOptions, caps_of, hardware_of, with_dry_limit
from framerunner.errors import SettingError

if TYPE_CHECKING:
    from framerunner.flying.plan import FlightPlan
    from framerunner.flying.run import FlightSettings
    from framerunner.flying.simulator_process import GenuineAutopilot
    from framerunner.wire.simulator_api import SimulatorApi
    from offboard.mission import Mission
    from scenarios.models import Scenario

_Drone = Annotated[
    str | None, Parameter(help="MAVLink URL of a running drone; without it a simulated one is started")
]
_Camera = Annotated[str | None, Parameter(help="URL, device or folder of its camera; needed with --drone")]
_CameraDelay = Annotated[
    float | None,
    Parameter(
        help="with --camera: age in s of an image that arrives without a time stamp; by default that of the "
        "calibration, else 0.1"
    ),
]
_Calibration = Annotated[
    Path | None,
    Parameter(
        help="its camera's calibration, a file of `framerunner camera calibrate`; for a simulated drone it "
        "replaces the camera's true one"
    ),
]
_Simulator = Annotated[
    str | None,
    Parameter(
        help="with --drone: http://HOST:PORT of the simulator that flies it: its referee judges, and without "
        "--camera its camera is used. By default that of an http --camera, if there is one"
    ),
]
_Instance = Annotated[
    WholeNumber | None,
    Parameter(
        help="of the simulated drone: shifts its ports, 0 to 9; by default 0, with --px4 or --ardupilot the "
        "first that is free"
    ),
]
_Lockstep = Annotated[
    bool, Parameter(help="in simulated time, as fast as the machine can, the same each time; no log")
]
_Seed = Annotated[
    WholeNumber | None,
    Parameter(help="of everything random in a lockstep flight, or with --px4 or --ardupilot; 0 if not given"),
]
_Record = Annotated[bool, Parameter(help="write flight.mcap as well, for `framerunner replay` and Foxglove")]
_Video = Annotated[
    bool, Parameter(help="write video.avi also in lockstep; in real time it is always written")
]
_Monitor = Annotated[
    bool,
    Parameter(help="open the Game Monitor as well, on http://127.0.0.1:8080/; it stays open until Ctrl-C"),
]
_WaitForViewer = Annotated[bool, Parameter(negative=(), help="with --monitor: fly when a browser shows it")]
_DroneLimits = Annotated[
    str | None,
    Parameter(
        help="with --drone, for a mission of class open: what the drone can do in m/s and rad/s, "
        "forward=2,left=1.5,up=1,yaw-rate=1.5; down=NUMBER if it is not as up"
    ),
]
_Response = Annotated[
    str | None,
    Parameter(
        help="with --lockstep: a vehicle that answers late, lag=0.6,dead-time=0.15,height-wander=0.05 in "
        "seconds and metres"
    ),
]
_MonitorLink = Annotated[
    str | None,
    Parameter(help="MAVLink URL of a monitor that runs already, such as udpout://127.0.0.1:14550"),
]
_Lifeline = Annotated[bool, Parameter(show=False, help="stop when standard input ends")]


@Parameter(name="*")
@dataclass(frozen=True, slots=True)
class GenuineOptions:
    """A genuine autopilot, as the command line gives it."""

    px4: Annotated[
        Path | None,
        Parameter(
            help="folder of a PX4 built for SITL: it flies the simulated drone instead of our autopilot"
        ),
    ] = None
    ardupilot: Annotated[
        Path | None, Parameter(help="folder of an ArduPilot built for SITL, which flies it likewise")
    ] = None


_OWN = GenuineOptions()


@Parameter(name="*")
@dataclass(frozen=True, slots=True)
class MonitorOptions:
    """Where a flight is shown, as the command line gives it."""

    monitor: _Monitor = False
    wait_for_viewer: _WaitForViewer = False
    monitor_link: _MonitorLink = None

    @property
    def checked(self) -> tuple[bool, bool, str | None]:
        """All three; SettingError if there is no monitor whose viewer can be waited for."""
        if self.wait_for_viewer and not self.monitor:
            raise SettingError("--wait-for-viewer: is for a monitor that is opened; add --monitor as well")
        return (self.monitor, self.wait_for_viewer, self.monitor_link)


_NO_MONITOR = MonitorOptions()


def fly(
    scenario: Annotated[str, Parameter(help="name or file of the scenario")] = "test-case-1",
    *,
    mission: Annotated[str, Parameter(help="name or file of the mission")] = DEFAULT_MISSION,
    drone: _Drone = None,
    camera: _Camera = None,
    camera_delay: _CameraDelay = None,
    calibration: _Calibration = None,
    simulator: _Simulator = None,
    speed: Annotated[float, Parameter(help="of the simulated drone: seconds a second, 0.01 to 100")] = 1.0,
    instance: _Instance = None,
    genuine: GenuineOptions = _OWN,
    lockstep: _Lockstep = False,
    seed: _Seed = None,
    sensors: Sensors = None,
    fault: Faults = (),
    record: _Record = False,
    video: _Video = False,
    shown: MonitorOptions = _NO_MONITOR,
    pilot: NamedPilot = None,
    drone_limits: _DroneLimits = None,
    response: _Response = None,
    hardware: HardwareOptions = NONE,
    out: Annotated[Path, Parameter(help="folder in which this flight's folder is made")] = Path("runs"),
    lifeline: _Lifeline = False,
) -> int:
    """Fly a mission, show it live, and write result, track, log and video to `runs/<time>-<scenario>/`.

    A drone given by --drone is taken for a real one, unless it is `framerunner sim` or --simulated: it is
    checked, and the operator holds G to arm; SPACE lands, then K stops the motors. Exit code 0:
    completed, 1: flown but not completed, 2: bad input or failed check.

    **Examples**

        framerunner fly test-case-1 --monitor

        framerunner fly test-case-1 --lockstep --record --sensors mocap

        framerunner fly --dry-run --drone serial:///dev/ttyUSB0:57600 --camera 0

        framerunner fly --drone serial:///dev/ttyUSB0:57600 --camera rtsp://10.0.0.2/1
    """
    api, autopilot = _simulator_api(simulator, drone), _genuine(genuine, drone=drone, lockstep=lockstep)
    camera = api.video_url if api is not None and camera is None else camera
    _check(drone, camera, camera_delay, speed, instance, lockstep=lockstep)
    seed, procedure = _checked_seed(seed, shown.monitor, lockstep, autopilot), hardware_of(hardware, drone)

    from framerunner.flying.real_time import RealTimeSettings
    from framerunner.flying.run import FlightSettings
    from offboard.mission import load_mission

    loaded = load_mission(mission, pilot)
    chosen = _scenario(scenario, sensors, fault, hardware, autopilot, starts=drone is None, lockstep=lockstep)
    plan = _plan(chosen, loaded, seed, response=response, drone=drone, drone_limits=drone_limits)
    plan = replace(_calibrated(plan, calibration), caps=caps_of(hardware, drone))
    with _instance(instance, autopilot) as number:
        real_time = RealTimeSettings(
            drone_url=drone,
            camera_url=camera,
            simulator=api,
            speed=speed,
            instance=number,
            autopilot=autopilot,
            camera_delay=delay_of(camera_delay, plan.calibration),
            hardware=procedure,
        )
        flown = None if lockstep else real_time
        return _run(FlightSettings(plan, flown, out, record, video, *shown.checked), lifeline=lifeline)


def _instance(given: int | None, autopilot: GenuineAutopilot | None) -> AbstractContextManager[int]:
    """The instance; with a genuine autopilot one that nobody uses, if none is given."""
    if given is not None or autopilot is None:
        return nullcontext(given or 0)
    from framerunner.instances import claimed_instance

    return claimed_instance()


def _run(settings: FlightSettings, *, lifeline: bool) -> int:
    from framerunner.child_process import until_standard_input_ends
    from framerunner.flying.run import fly_once

    if settings.real_time is not None and not settings.real_time.repeats:
        say(
            "PX4 may not use real-time priorities here, so its flights with the same seed are alike, not the "
            "same (on Linux they are, as root or with `ulimit -r 99`)"
        )
    work = fly_once(settings)
    return asyncio.run(until_standard_input_ends(work)) or 0 if lifeline else asyncio.run(work)


def _scenario(
    name: str,
    sensors: str | None,
    fault: tuple[str, ...],
    hardware: HardwareOptions,
    autopilot: GenuineAutopilot | None,
    *,
    starts: bool,
    lockstep: bool,
) -> Scenario:
    """The scenario that the options describe; `starts`: a simulated drone is started."""
    from scenarios.loader import load_scenario

    if sensors is not None and not starts:
        raise SettingError("--sensors: are those of a simulated drone; leave it out with --drone")
    if fault and not starts:
        raise SettingError("--fault: is for a simulated drone that is started; leave it out with --drone")
    loaded = with_dry_limit(load_scenario(name), hardware)
    scenario = with_faults(with_sensors(loaded, sensors), fault)
    failing = next((each for each in scenario.faults if each.part == "link"), None)
    if failing is not None and starts and not lockstep:
        advice = "add --lockstep, or start framerunner sim and fly it with --drone"
        raise SettingError(
            f"fault `{failing}`: vehicle time waits for the app at each packet, so none can be late or lost; "
            f"{advice if autopilot is None else 'leave it out'}"
        )
    return scenario if autopilot is None else for_genuine(autopilot.title, scenario)


def _calibrated(plan: FlightPlan, path: Path | None) -> FlightPlan:
    """The plan with the calibration of the drone's camera, if one is given."""
    if path is None:
        return plan
    from framerunner.camera_calibration.calibration_file import load_calibration

    if plan.chart.vision == "boxes":
        raise SettingError(
            f"--calibration: mission {plan.chart.name} sees boxes, whose formulas know no lens; leave it out "
            "or fly one with vision: frames"
        )
    return replace(plan, calibration=load_calibration(path))


def _plan(
    scenario: Scenario,
    mission: Mission,
    seed: int | None,
    *,
    response: str | None,
    drone: str | None,
    drone_limits: str | None,
) -> FlightPlan:
    """The flight that the options describe; a seed is given in lockstep."""
    from framerunner.commands.options.named_numbers import limits_of, response_of
    from framerunner.flying.plan import FlightPlan

    if response is not None and seed is None:
        raise SettingError("--response: is for a simulated vehicle in lockstep; add --lockstep")
    is_open = mission.mission_class == "open"
    if drone_limits is not None and (drone is None or not is_open):
        why = (
            "a mission of class contest flies by the contest's"
            if drone
            else "is for a drone given by --drone"
        )
        raise SettingError(f"--drone-limits: {why}; leave it out")
    if drone is not None and is_open and drone_limits is None:
        raise SettingError(
            f"--drone-limits: mission {mission.name} is of class open, so say what the drone can do, such as "
            "--drone-limits forward=2,left=1.5,up=1,yaw-rate=1.5"
        )
    return FlightPlan(
        scenario,
        mission,
        seed,
        drone_limits=None if drone_limits is None else limits_of(drone_limits),
        response=None if response is None else response_of(response),
    )


def _simulator_api(url: str | None, drone: str | None) -> SimulatorApi | None:
    if url is None:
        return None
    if drone is None:
        raise SettingError("--simulator: is for a drone that is running already; name it with --drone")
    from framerunner.wire.simulator_api import SimulatorApi

    try:
        return SimulatorApi.at(url)
    except ValueError as error:
        raise SettingError(f"--simulator {error}") from None


def _genuine(given: GenuineOptions, *, drone: str | None, lockstep: bool) -> GenuineAutopilot | None:
    """The autopilot of the user's that flies the simulated drone, if one is given."""
    from framerunner.flying.simulator_process import GenuineAutopilot

    px4, ardupilot = given.px4, given.ardupilot
    if px4 is not None and ardupilot is not None:
        raise SettingError(f"--ardupilot {ardupilot}: one autopilot flies; leave it or --px4 out")
    if px4 is not None:
        from sitl.px4.build import find_build

        chosen = GenuineAutopilot("px4", px4)
    elif ardupilot is not None:
        from sitl.ardupilot.build import find_build

        chosen = GenuineAutopilot("ardupilot", ardupilot)
    else:
        return None
    option = f"--{chosen.name} {chosen.folder}"
    if drone is not None:
        raise SettingError(f"{option}: flies a simulator that is started; leave it out with --drone")
    if lockstep:
        raise SettingError(f"{option}: it is another process; leave out --lockstep")
    find_build(chosen.folder)
    return chosen


def _check(
    drone: str | None,
    camera: str | None,
    delay_s: float | None,
    speed: float,
    instance: int | None,
    *,
    lockstep: bool,
) -> None:
    """Refuse options that do not go together, and numbers out of range."""
    check_range("--camera-delay", delay_s, 0.0, 0.5)
    if drone is not None and camera is None:
        raise SettingError("--camera: a drone given by --drone needs the URL of its camera too")
    if drone is None and camera is not None:
        raise SettingError("--drone: a camera given by --camera needs the URL of its drone too")
    if drone is not None and (speed != 1.0 or instance):
        raise SettingError("--speed and --instance are for the simulated drone; leave them out with --drone")
    unused = [("--drone", drone is not None), ("--speed", speed != 1.0), ("--instance", bool(instance))]
    given = [option for option, is_given in unused if is_given]
    if lockstep and given:
        raise SettingError(
            f"--lockstep: flies a simulated drone in this process; leave out {' and '.join(given)}"
        )
    check_range("--speed", speed, 0.01, 100)
    check_range("--instance", instance, 0, 9)


def _checked_seed(
    seed: int | None, monitor: bool, lockstep: bool, autopilot: GenuineAutopilot | None
) -> int | None:
    """The seed of a flight in lockstep or of one with a genuine autopilot; None in real time."""
    if monitor and lockstep:
        raise SettingError("--monitor: shows flights in real time; leave it out with --lockstep")
    if seed is None:
        return 0 if lockstep or autopilot is not None else None
    if not lockstep and autopilot is None:
        raise SettingError(
            f"--seed {seed}: is for a flight in lockstep, or with --px4 or --ardupilot; add one of them "
            "or leave it out, which is seed 0"
        )
    if not 0 <= seed < 2**63:
        raise SettingError(f"--seed {seed}: must be from 0 to {2**63 - 1}")
    return seed
