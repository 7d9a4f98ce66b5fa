"""`framerunner px4`, and the simulator whose autopilot is PX4."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cyclopts import App

from framerunner.commands import for_genuine, say, with_faults, with_sensors

if TYPE_CHECKING:
    from framerunner.commands.sim import Onboard
    from sitl.autopilots.process import AutopilotStart
    from sitl.pacing.time_grants import TimeGrants
    from sitl.px4.server import Px4Server
    from sitl.px4.simulation import Px4Simulation
    from sitl.server_settings import ServerSettings

app = App(name="px4", help="What a genuine PX4 needs to fly in the simulated world.")


@app.command
def params(
    airframe: str = "x500",
    *,
    sensors: str = "mocap",
    speed: float = 1.0,
    env: bool = False,
    transmitter: bool = False,
) -> int:
    """Print the parameters by which PX4 flies an airframe here: one `NAME VALUE` a line.

    **Examples**

        framerunner px4 params x500

        framerunner px4 params abejorro --sensors outdoor --env

    Args:
        airframe: name or file of the airframe
        sensors: sensor suite for which PX4's estimator is set up: mocap, outdoor, …, or a file
        speed: of the simulation, by which PX4's time-outs grow
        env: as environment variables, by which PX4 takes them at its start
        transmitter: for a pilot's remote control, too
    """
    from framerunner.vehicle.airframe import load_airframe
    from sitl.autopilots.parameters import text_of
    from sitl.px4.build import environment
    from sitl.px4.parameters import all_parameters
    from sitl.sensors.suite import load_suite

    frame, suite = load_airframe(airframe), load_suite(sensors)
    values = all_parameters(frame, suite, speed, transmitter=transmitter)
    lines = (
        [f"{name}={text}" for name, text in environment(values).items()]
        if env
        else [f"{name} {text_of(value)}" for name, value in sorted(values.items())]
    )
    print("\n".join(lines))
    return 0


def px4_server(
    scenario: str,
    settings: ServerSettings,
    onboard: Onboard,
    fault: tuple[str, ...],
    *,
    px4: Path | None,
    transmitter: str | None,
    seed: int,
    grants: TimeGrants | None,
) -> Px4Server:
    """The simulator with PX4, by the options of `framerunner sim`."""
    from scenarios.loader import load_scenario
    from sitl.px4.server import Px4Server
    from sitl.px4.simulation import Px4Simulation
    from sitl.px4.transmitter import open_transmitter

    sticks = None if transmitter is None else open_transmitter(transmitter)
    chosen = with_faults(for_genuine("PX4", with_sensors(load_scenario(scenario), onboard.sensors)), fault)

    def new_simulation() -> Px4Simulation:
        return Px4Simulation(chosen, seed=seed, transmitter=sticks)

    simulation = new_simulation()  # so that what is wrong with it is said first
    start = _start(simulation, settings, px4)
    return Px4Server(new_simulation, settings, start, notice=say, grants=grants)


def _start(simulation: Px4Simulation, settings: ServerSettings, px4: Path | None) -> AutopilotStart:
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
    if px4 is None:
        return AutopilotStart(None, command)
    build = find_build(px4)
    suite = load_suite(scenario.sensors)
    values = all_parameters(
        simulation.world.airframe, suite, settings.speed, transmitter=simulation.has_transmitter
    )
    folder = None if settings.storage is None else settings.storage / f"px4-{settings.instance}"
    return AutopilotStart(Px4Process(build, settings.instance, folder, values), command)
