"""`framerunner ardupilot`, and the simulator whose autopilot is ArduPilot."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import App

from framerunner.commands import for_genuine, say, with_faults, with_sensors

if TYPE_CHECKING:
    from framerunner.commands.sim import Onboard
    from sitl.ardupilot.server import ArduPilotServer
    from sitl.ardupilot.simulation import ArduPilotSimulation
    from sitl.autopilots.process import AutopilotStart
    from sitl.pacing.time_grants import TimeGrants
    from sitl.server_settings import ServerSettings

app = App(name="ardupilot", help="What a genuine ArduCopter needs to fly in the simulated world.")


@app.command
def params(
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


def ardupilot_server(
    scenario: str,
    settings: ServerSettings,
    onboard: Onboard,
    fault: tuple[str, ...],
    *,
    ardupilot: Path | None,
    seed: int,
    grants: TimeGrants | None,
) -> ArduPilotServer:
    """The simulator with ArduPilot, by the options of `framerunner sim`."""
    from scenarios.loader import load_scenario
    from sitl.ardupilot.server import ArduPilotServer
    from sitl.ardupilot.simulation import ArduPilotSimulation

    chosen = with_faults(
        for_genuine("ArduPilot", with_sensors(load_scenario(scenario), onboard.sensors)), fault
    )

    def new_simulation() -> ArduPilotSimulation:
        return ArduPilotSimulation(chosen, seed=seed)

    simulation = new_simulation()  # so that what is wrong with it is said first
    start = _start(simulation, settings, ardupilot, relayed=grants is not None)
    return ArduPilotServer(new_simulation, settings, start, notice=say, grants=grants)


def _start(
    simulation: ArduPilotSimulation, settings: ServerSettings, ardupilot: Path | None, *, relayed: bool
) -> AutopilotStart:
    from sitl.ardupilot.build import ArduPilotProcess, find_build, options
    from sitl.ardupilot.parameters import all_parameters
    from sitl.autopilots.process import AutopilotStart
    from sitl.sensors.suite import load_suite

    scenario, home = simulation.scenario, simulation.place
    how = {"takes_poses": simulation.sends_poses, "relayed": relayed}
    values = all_parameters(simulation.world.airframe, load_suite(scenario.sensors))
    file = f"{simulation.world.airframe.name}.parm"
    command = (
        f"framerunner ardupilot params {scenario.airframe} --sensors {scenario.sensors} > {file}; "
        f"arducopter {shlex.join(options(settings, home, file, **how))}"
    )
    if ardupilot is None:
        return AutopilotStart(None, command)
    folder = None if settings.storage is None else settings.storage / f"ardupilot-{settings.instance}"
    program = find_build(ardupilot)
    process = ArduPilotProcess(program, settings, home, values, folder, **how)
    return AutopilotStart(process, command)
