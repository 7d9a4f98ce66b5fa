"""`framerunner px4` and `framerunner ardupilot`, and the simulators whose autopilot is one of them."""

from __future__ import annotations

import shlex
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import App

from framerunner.commands import say

if TYPE_CHECKING:
    from scenarios.models import Scenario
    from sitl.ardupilot.server import ArduPilotServer
    from sitl.ardupilot.simulation import ArduPilotSimulation
    from sitl.autopilots.process import AutopilotStart
    from sitl.pacing.time_grants import TimeGrants
    from sitl.px4.server import Px4Server
    from sitl.px4.simulation import Px4Simulation
    from sitl.server_settings import ServerSettings

px4 = App(name="px4", help="What a genuine PX4 needs to fly in the simulated world.")
ardupilot = App(name="ardupilot", help="What a genuine ArduCopter needs to fly in the simulated world.")


@px4.command(name="params")
def px4_params(
    airframe: str = "x500",
    *,
    sensors: str = "mocap",
    speed: float = 1.0,
    env: bool = False,
    transmitter: bool = False,
    real: bool = False,
) -> int:
    """Print the parameters by which PX4 flies an airframe here: one `NAME VALUE` a line.

    With --real those by which the estimator of a real drone uses such sensors, and no others, as a file for
    QGroundControl and for `preflight --restore-parameters`.

    **Examples**

        framerunner px4 params x500

        framerunner px4 params abejorro --sensors outdoor --env

        framerunner px4 params --real --sensors flow

    Args:
        airframe: name or file of the airframe
        sensors: sensor suite for which PX4's estimator is set up: mocap, outdoor, …, or a file
        speed: of the simulation, by which PX4's time-outs grow
        env: as environment variables, by which PX4 takes them at its start
        transmitter: for a pilot's remote control, too
        real: for a real drone with motion capture or with optical flow and range finder
    """
    from framerunner.preflight.kept import parameter_lines
    from framerunner.vehicle.airframe import load_airframe
    from framerunner.wire.dialect import mavlink
    from framerunner.wire.session.session import ParameterValue
    from sitl.autopilots.parameters import text_of
    from sitl.px4.build import environment
    from sitl.px4.parameters import all_parameters, drone_parameters
    from sitl.sensors.suite import load_suite

    if real:
        kinds = {int: mavlink.MAV_PARAM_TYPE_INT32, float: mavlink.MAV_PARAM_TYPE_REAL32}
        wanted = drone_parameters(load_suite(sensors)).items()
        file = parameter_lines(1, (ParameterValue(name, value, kinds[type(value)]) for name, value in wanted))
        print("\n".join(file))
        return 0
    frame, suite = load_airframe(airframe), load_suite(sensors)
    values = all_parameters(frame, suite, speed, transmitter=transmitter)
    lines = (
        [f"{name}={text}" for name, text in environment(values).items()]
        if env
        else [f"{name} {text_of(value)}" for name, value in sorted(values.items())]
    )
    print("\n".join(lines))
    return 0


@ardupilot.command(name="params")
def ardupilot_params(
    airframe: str = "x500",
    *,
    sensors: str = "mocap",
) -> int:
    """Print the parameters by which ArduCopter flies an airframe here: one `NAME VALUE` a line.

    **Examples**

        framerunner ardupilot params abejorro > abejorro.parm

    Args:
        airframe: name or file of the airframe
        sensors: sensor suite: mocap for poses of motion capture, outdoor for GPS, or a file
    """
    from framerunner.vehicle.airframe import load_airframe
    from sitl.ardupilot.parameters import all_parameters, file_of
    from sitl.sensors.suite import load_suite

    print(file_of(all_parameters(load_airframe(airframe), load_suite(sensors))), end="")
    return 0


def px4_server(
    scenario: Scenario,
    settings: ServerSettings,
    *,
    folder: Path | None,
    transmitter: str | None,
    seed: int,
    grants: TimeGrants | None,
) -> Px4Server:
    """The simulator with PX4, in a folder or, if it is None, started by the user."""
    from sitl.px4.server import Px4Server
    from sitl.px4.simulation import Px4Simulation
    from sitl.px4.transmitter import open_transmitter

    sticks = None if transmitter is None else open_transmitter(transmitter)
    new_simulation = partial(Px4Simulation, scenario, seed=seed, transmitter=sticks)
    simulation = new_simulation()  # so that what is wrong with it is said first
    start = _start_px4(simulation, settings, folder)
    return Px4Server(new_simulation, settings, start, notice=say, grants=grants)


def ardupilot_server(
    scenario: Scenario,
    settings: ServerSettings,
    *,
    folder: Path | None,
    seed: int,
    grants: TimeGrants | None,
) -> ArduPilotServer:
    """The simulator with ArduPilot, in a folder or, if it is None, started by the user."""
    from sitl.ardupilot.server import ArduPilotServer
    from sitl.ardupilot.simulation import ArduPilotSimulation

    new_simulation = partial(ArduPilotSimulation, scenario, seed=seed)
    simulation = new_simulation()  # so that what is wrong with it is said first
    start = _start_ardupilot(simulation, settings, folder, relayed=grants is not None)
    return ArduPilotServer(new_simulation, settings, start, notice=say, grants=grants)


def _start_px4(simulation: Px4Simulation, settings: ServerSettings, built: Path | None) -> AutopilotStart:
    from sitl.autopilots.process import AutopilotStart
    from sitl.px4.build import Px4Process, find_build
    from sitl.px4.parameters import all_parameters
    from sitl.sensors.suite import load_suite

    scenario = simulation.scenario
    command = (
        f"env $(framerunner px4 params {scenario.airframe} --sensors {scenario.sensors} --speed "
        f"{settings.speed:g}{' --transmitter' if simulation.has_transmitter else ''} --env) "
        f"build/px4_sitl_default/bin/px4 -i {settings.instance}"
    )
    if built is None:
        return AutopilotStart(None, command)
    build = find_build(built)
    suite = load_suite(scenario.sensors)
    values = all_parameters(
        simulation.world.airframe, suite, settings.speed, transmitter=simulation.has_transmitter
    )
    folder = None if settings.storage is None else settings.storage / f"px4-{settings.instance}"
    return AutopilotStart(Px4Process(build, settings.instance, folder, values), command)


def _start_ardupilot(
    simulation: ArduPilotSimulation, settings: ServerSettings, built: Path | None, *, relayed: bool
) -> AutopilotStart:
    from sitl.ardupilot.build import ArduPilotProcess, find_build, options
    from sitl.ardupilot.parameters import all_parameters
    from sitl.autopilots.process import AutopilotStart
    from sitl.sensors.suite import load_suite

    scenario, home = simulation.scenario, simulation.place
    how = {"takes_sensors": simulation.sends_sensors, "relayed": relayed}
    values = all_parameters(simulation.world.airframe, load_suite(scenario.sensors))
    file = f"{simulation.world.airframe.name}.parm"
    command = (
        f"framerunner ardupilot params {scenario.airframe} --sensors {scenario.sensors} > {file}; "
        f"arducopter {shlex.join(options(settings, home, file, **how))}"
    )
    if built is None:
        return AutopilotStart(None, command)
    folder = None if settings.storage is None else settings.storage / f"ardupilot-{settings.instance}"
    program = find_build(built)
    process = ArduPilotProcess(program, settings, home, values, folder, **how)
    return AutopilotStart(process, command)
