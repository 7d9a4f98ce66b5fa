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
    for_genuine,
    say,
    with_faults,
    with_sensors,
    within,
)
from framerunner.commands.options.flight import (
    DRONE_GROUP,
    GENUINE,
    ONE_AUTOPILOT,
    OUTPUT_GROUP,
    SIMULATION_GROUP,
    CameraDelay,
    GenuineOptions,
    Lifeline,
    Response,
    SettingsFile,
    program_of,
)
from framerunner.commands.options.hardware import (
    HARDWARE_RULES,
    NONE,
    HardwareOptions,
    caps_of,
    given_hardware,
    hardware_of,
    with_dry_limit,
)
from framerunner.commands.options.rules import OptionRule, check_rules, for_each, given_in
from framerunner.errors import SettingError
from framerunner.flying.output import OutputSettings
from framerunner.preflight.settings import HardwareSettings

if TYPE_CHECKING:
    from framerunner.flying.plan import FlightPlan
    from framerunner.flying.run import FlightSettings
    from framerunner.flying.simulator_process import GenuineAutopilot
    from framerunner.wire.simulator_api import SimulatorApi
    from offboard.mission import Mission
    from scenarios.models import Scenario


ALONE = "vio"  # sensors of a drone that has its place from the app


@Parameter(name="*", group=DRONE_GROUP)
@dataclass(frozen=True, slots=True, kw_only=True)
class DroneOptions:
    """A drone that is running already.

    Attributes:
        drone: MAVLink URL of a running drone; without it a simulated one is started
        camera: URL, device or folder of its camera; needed with --drone
        camera_delay: age of an image that arrives without a time stamp.
        calibration: its camera's calibration, a file of `framerunner camera calibrate`; for a simulated drone
            it replaces the camera's true one
        simulator: with --drone: http://HOST:PORT of the simulator that flies it: its referee judges, and
            without --camera its camera is used. By default that of an http --camera, if there is one
        drone_limits: with --drone, for a mission of class open: what the drone can do in m/s and rad/s,
            forward=2,left=1.5,up=1,yaw-rate=1.5; down=NUMBER if it is not as up
        vio: with --drone: it knows its place only by what this program estimates with its camera and IMU, and
            is sent it as ODOMETRY; at first that it stands on the start
    """

    drone: str | None = None
    camera: str | None = None
    camera_delay: CameraDelay = None
    calibration: Path | None = None
    simulator: str | None = None
    drone_limits: str | None = None
    vio: bool = False


@Parameter(name="*", group=SIMULATION_GROUP)
@dataclass(frozen=True, slots=True, kw_only=True)
class SimulationOptions:
    """A simulated drone that is started.

    Attributes:
        speed: simulated seconds a second, 0.01 to 100
        instance: shifts its ports, 0 to 9; by default 0, with --px4 or --ardupilot the first that is free
        lockstep: in simulated time, as fast as the machine can, the same each time; no log
        seed: of everything random in a lockstep flight, or with --px4 or --ardupilot; 0 if not given
        sensors: the drone's sensor suite.
        fault: what fails.
        response: a vehicle that answers late.
    """

    speed: Annotated[float, within(0.01, 100)] = 1.0
    instance: Annotated[WholeNumber | None, within(0, 9)] = None
    lockstep: bool = False
    seed: Annotated[WholeNumber | None, within(0, 2**63 - 1)] = None
    sensors: Sensors = None
    fault: Faults = ()
    response: Response = None


_DRONE, _SIMULATION, _OWN, _OUTPUT = DroneOptions(), SimulationOptions(), GenuineOptions(), OutputSettings()
_RULES = (
    OptionRule("simulator", "is for a drone that is running already; name it with --drone", needs=("drone",)),
    ONE_AUTOPILOT,
    *for_each(GENUINE, "flies a simulator that is started; leave it out with --drone", excludes=("drone",)),
    *for_each(GENUINE, "it is another process; leave out --lockstep", excludes=("lockstep",)),
    OptionRule("drone", "needs the URL of its camera too; add --camera", needs=("camera", "simulator")),
    OptionRule("camera", "needs the URL of its drone too; add --drone", needs=("drone",)),
    *for_each(
        ("speed", "instance"), "is for the simulated drone; leave it out with --drone", excludes=("drone",)
    ),
    OptionRule(
        "lockstep",
        "flies a simulated drone in this process; leave out {found}",
        excludes=("drone", "speed", "instance"),
    ),
    OptionRule("monitor", "shows flights in real time; leave it out with --lockstep", excludes=("lockstep",)),
    OptionRule(
        "wait-for-viewer", "is for a monitor that is opened; add --monitor as well", needs=("monitor",)
    ),
    OptionRule(
        "seed",
        "is for a flight in lockstep, or with --px4 or --ardupilot; add one of them or leave it out, which "
        "is seed 0",
        needs=("lockstep", *GENUINE),
    ),
    *for_each(
        ("sensors", "fault"), "is for a simulated drone; leave it out with --drone", excludes=("drone",)
    ),
    OptionRule("response", "is for a simulated vehicle in lockstep; add --lockstep", needs=("lockstep",)),
    OptionRule("drone-limits", "is for a drone given by --drone; leave it out", needs=("drone",)),
    OptionRule("vio", "is for a drone given by --drone; others have --sensors vio", needs=("drone",)),
    *HARDWARE_RULES,
)
"""Which options exclude or need which others; the first rule that is broken is told."""


def fly(
    scenario: str = "test-case-1",
    *,
    mission: str = DEFAULT_MISSION,
    pilot: NamedPilot = None,
    flown: DroneOptions = _DRONE,
    simulated: SimulationOptions = _SIMULATION,
    genuine: GenuineOptions = _OWN,
    output: Annotated[OutputSettings, Parameter(name="*", group=OUTPUT_GROUP)] = _OUTPUT,
    settings: SettingsFile = None,
    hardware: HardwareOptions = NONE,
    lifeline: Lifeline = False,
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

        framerunner fly --vio --drone serial:///dev/ttyUSB0:921600 --camera 0

        framerunner fly --settings flight.yaml

    Args:
        scenario: name or file of the scenario
        mission: name or file of the mission
        pilot: primitives of your own.
        flown: a drone that is running already.
        simulated: a simulated drone.
        genuine: a genuine autopilot.
        output: what is left, and where it is shown.
        settings: file of options.
        hardware: how a real drone is flown.
        lifeline: stop when standard input ends.
    """
    given = {**given_in(flown, simulated, genuine, output), **given_hardware(hardware)}
    if simulated.instance == 0:  # as without the option
        del given["instance"]
    check_rules(_RULES, given)
    api, autopilot, drone = _simulator_api(flown.simulator), genuine.autopilot, flown.drone
    if autopilot is not None:
        program_of(autopilot)
    procedure = hardware_of(hardware, drone)

    from framerunner.flying.real_time import RealTimeSettings
    from framerunner.flying.run import FlightSettings
    from offboard.mission import load_mission

    loaded = load_mission(mission, pilot)
    chosen = _scenario(scenario, simulated, hardware, autopilot, starts=drone is None)
    chosen = with_sensors(chosen, ALONE if flown.vio else None)
    plan = replace(_plan(chosen, loaded, flown, simulated, autopilot), caps=caps_of(hardware, drone))
    with _instance(simulated.instance, autopilot) as number:
        real_time = RealTimeSettings(
            drone_url=drone,
            camera_url=api.video_url if api is not None and flown.camera is None else flown.camera,
            simulator=api,
            speed=simulated.speed,
            instance=number,
            autopilot=autopilot,
            camera_delay=delay_of(flown.camera_delay, plan.calibration),
            hardware=procedure,
        )
        flight = FlightSettings(plan, None if simulated.lockstep else real_time, output)
        return _run(flight, lifeline=lifeline)


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
    options: SimulationOptions,
    hardware: HardwareSettings,
    autopilot: GenuineAutopilot | None,
    *,
    starts: bool,
) -> Scenario:
    """The scenario that the options describe; `starts`: a simulated drone is started."""
    from scenarios.loader import load_scenario

    loaded = with_dry_limit(load_scenario(name), hardware)
    scenario = with_faults(with_sensors(loaded, options.sensors), options.fault)
    failing = next((each for each in scenario.faults if each.part == "link"), None)
    if failing is not None and starts and not options.lockstep:
        advice = "add --lockstep, or start framerunner sim and fly it with --drone"
        raise SettingError(
            f"fault `{failing}`: vehicle time waits for the app at each packet, so none can be late or lost; "
            f"{advice if autopilot is None else 'leave it out'}"
        )
    return scenario if autopilot is None else for_genuine(autopilot.title, scenario)


def _plan(
    scenario: Scenario,
    mission: Mission,
    flown: DroneOptions,
    simulated: SimulationOptions,
    autopilot: GenuineAutopilot | None,
) -> FlightPlan:
    """The flight that the options describe, with the calibration of the drone's camera, if one is given."""
    from framerunner.camera_calibration.calibration_file import load_calibration
    from framerunner.commands.options.named_numbers import limits_of, response_of
    from framerunner.flying.plan import FlightPlan

    limits, is_open = flown.drone_limits, mission.mission_class == "open"
    if limits is not None and not is_open:
        raise SettingError("--drone-limits: a mission of class contest flies by the contest's; leave it out")
    if flown.drone is not None and is_open and limits is None:
        raise SettingError(
            f"--drone-limits: mission {mission.name} is of class open, so say what the drone can do, such as "
            "--drone-limits forward=2,left=1.5,up=1,yaw-rate=1.5"
        )
    if flown.calibration is not None and mission.vision == "boxes":
        raise SettingError(
            f"--calibration: mission {mission.name} sees boxes, whose formulas know no lens; leave it out "
            "or fly one with vision: frames"
        )
    is_seeded = simulated.lockstep or autopilot is not None
    return FlightPlan(
        scenario,
        mission,
        (simulated.seed or 0) if is_seeded else None,
        drone_limits=None if limits is None else limits_of(limits),
        response=None if simulated.response is None else response_of(simulated.response),
        calibration=None if flown.calibration is None else load_calibration(flown.calibration),
    )


def _simulator_api(url: str | None) -> SimulatorApi | None:
    if url is None:
        return None
    from framerunner.wire.simulator_api import SimulatorApi

    try:
        return SimulatorApi.at(url)
    except ValueError as error:
        raise SettingError(f"--simulator {error}") from None
