"""`framerunner sim`: the simulated drone as a program."""

from __future__ import annotations

import asyncio
import socket
from contextlib import AsyncExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, Protocol

from cyclopts import Group, Parameter

from framerunner.commands import (
    Faults,
    Sensors,
    ShowLayout,
    WholeNumber,
    check_range,
    for_genuine,
    say,
    with_faults,
    with_sensors,
    within,
)
from framerunner.commands.genuine import ardupilot_server, px4_server
from framerunner.commands.options.rules import OptionRule, check_rules, given_in
from framerunner.errors import SettingError
from framerunner.extras import install_advice, is_installed
from framerunner.files.text_file import TextError, read_text
from sitl.autopilots import TITLES

if TYPE_CHECKING:
    from framerunner.child_process import MonitorProcess
    from framerunner.wire.signing import SigningKey
    from scenarios.models import Scenario
    from sitl.pacing.time_grants import TimeGrants
    from sitl.server_settings import ServerSettings
    from sitl.simulation import Simulation
    from sitl.truth_channel import TruthChannel

_MAX_INSTANCES = 10  # as PX4: the apps' port of an eleventh is the ground stations' port of the first


class _Server(Protocol):
    async def run(self) -> None:
        """Run until cancelled."""


@Parameter(name="*", group=Group("On board", sort_key=2))
@dataclass(frozen=True, slots=True, kw_only=True)
class Onboard:
    """What the drone has besides flying.

    Attributes:
        storage: folder for its files and flight logs, DIR/0 for instance 0; else a temporary one
        parameters: file of changed parameters (.params), read at start and saved when one changes
        sensors: the drone's sensor suite.
        shell: answer MAVLink's shell (SERIAL_CONTROL), for the drone only
        camera: announce the camera over MAVLink, as a separate component, take photos, record video
    """

    storage: Path | None = None
    parameters: Path | None = None
    sensors: Sensors = None
    shell: bool = False
    camera: Annotated[bool, Parameter(negative="--no-camera")] = True


@Parameter(name="*", group=Group("Connections", sort_key=1))
@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorConnections:
    """Where the simulator listens and sends.

    Attributes:
        bind: address to listen on
        onboard_remote: host or host:port that gets the onboard link, UDP 14540 + instance
        ground_remote: host or host:port that gets the ground link, UDP 14550
        link: one more link: udpout://HOST:PORT, udpin://…, tcpin://…, tcpout://…, serial:///TTY:BAUD,
            optionally followed by ?streams=onboard|ground|normal&rate=BYTES; may be repeated
        signing_key: file with 64 hexadecimal digits or a passphrase: sign MAVLink 2 with it
        video_port: TCP port of the video; 8100 + instance if not given
        video_rtp: host or host:port that gets the video as H.264 in RTP, UDP 5600, or off
        show_layout: tell every app the layout.
    """

    bind: str = "127.0.0.1"
    onboard_remote: str = "127.0.0.1"
    ground_remote: str = "127.0.0.1"
    link: tuple[str, ...] = ()
    signing_key: Path | None = None
    video_port: WholeNumber | None = None
    video_rtp: str = "127.0.0.1"
    show_layout: ShowLayout = False


@Parameter(name="*", group=Group("Autopilot", sort_key=3))
@dataclass(frozen=True, slots=True, kw_only=True)
class FlownBy:
    """Which autopilot flies the drone.

    Attributes:
        autopilot: what flies: this project's autopilot, or a genuine PX4 or ArduCopter
        px4: with --autopilot px4: folder of a PX4 built for SITL, to be started; else start it yourself
        ardupilot: with --autopilot ardupilot: folder of an ArduPilot built for SITL, to be started; else
            start it yourself
        transmitter: with --autopilot px4: a pilot's remote control: `centred`, or a transmitter on USB such
            as /dev/input/js0
    """

    autopilot: Literal["own", "px4", "ardupilot"] = "own"
    px4: Path | None = None
    ardupilot: Path | None = None

    transmitter: str | None = None


def _rules_for(name: Literal["px4", "ardupilot"]) -> tuple[OptionRule, ...]:
    """What the drone does not have if a genuine autopilot flies it."""
    title = TITLES[name]
    remotes = ("onboard-remote", "ground-remote") if name == "px4" else ()
    reasons = {
        **dict.fromkeys(("link", "signing-key", "shell", *remotes), f"MAVLink is {title}'s own"),
        "count": f"{title} flies one drone; start another simulator with --instance 1",
        "monitor": f"run framerunner monitor beside it, which listens to {title} on UDP 14550",
        "parameters": f"{title} keeps its own, with --storage DIR",
    }
    chosen = f"autopilot {name}"
    return (
        OptionRule(name, f"is for {title}; add --{chosen}", needs=(chosen,)),
        *(
            OptionRule(option, f"{why}; leave it out with {{found}}", excludes=(chosen,), shows_value=False)
            for option, why in reasons.items()
        ),
    )


_RULES = (
    *_rules_for("px4"),
    *_rules_for("ardupilot"),
    OptionRule("transmitter", "is for PX4; add --autopilot px4", needs=("autopilot px4",)),
)


@Parameter(name="*", show=False)
@dataclass(frozen=True, slots=True, kw_only=True)
class StartedBy:
    """What the program that has started this one wants of it, over descriptors of sockets.

    Attributes:
        lifeline: stop when standard input ends
        time_grants: by which it grants time
        truth: by which it gets true states
    """

    lifeline: bool = False
    time_grants: int | None = None
    truth: int | None = None

    def grants(self) -> TimeGrants | None:
        """Its end of the channel of time; None: it grants none, and time runs."""
        if self.time_grants is None:
            return None
        from sitl.pacing.time_grants import TimeGrants

        return TimeGrants(socket.socket(fileno=self.time_grants))

    def truth_channel(self) -> TruthChannel | None:
        """Its end of the channel of true states; None: it asks for none."""
        if self.truth is None:
            return None
        from sitl.truth_channel import TruthChannel

        return TruthChannel(socket.socket(fileno=self.truth))


def sim(
    *,
    scenario: str = "open-field",
    speed: Annotated[float, within(0.01, 1000)] = 1.0,
    instance: Annotated[WholeNumber, within(0, _MAX_INSTANCES - 1)] = 0,
    count: WholeNumber = 1,
    seed: Annotated[WholeNumber, within(0, 2**63 - 1)] = 0,
    fault: Faults = (),
    connections: SimulatorConnections | None = None,
    onboard: Onboard | None = None,
    flown_by: FlownBy | None = None,
    monitor: bool = False,
    started_by: StartedBy | None = None,
) -> int:
    """Start the simulated drone: MAVLink on UDP 14540 and 14550, video on http://127.0.0.1:8100/.

    Its devices, such as the camera, are also on UDP 14030. Stop it with Ctrl-C.

    **Examples**

        framerunner sim

        framerunner sim --scenario test-case-1 --speed 2 --sensors mocap

        framerunner sim --scenario test-case-1 --monitor

        framerunner sim --count 4 --video-rtp off

        framerunner sim --storage drone-files --parameters drone.params

        framerunner sim --link tcpin://127.0.0.1:5760

        framerunner sim --autopilot px4 --px4 ../PX4-Autopilot

        framerunner sim --autopilot ardupilot --ardupilot ../ardupilot

    Args:
        scenario: name or file; without it an open field and an x500
        speed: simulated seconds a second, 0.01 to 1000
        instance: shifts ports and the system id, 0 to 9
        count: how many drones fly side by side; they have the next instances' ports
        seed: of everything random, such as turbulence
        fault: what fails.
        connections: where it listens and sends.
        onboard: what the drone has besides flying.
        flown_by: which autopilot flies.
        monitor: open the Game Monitor as well, on http://127.0.0.1:8080/
        started_by: what the program that started it wants.
    """
    check_range("--count", count, 1, _MAX_INSTANCES - instance)
    chosen, onboard, flown_by = (
        connections or SimulatorConnections(),
        onboard or Onboard(),
        flown_by or FlownBy(),
    )
    given = given_in(chosen, onboard, flown_by)
    given |= {name: True for name, is_given in (("count", count != 1), ("monitor", monitor)) if is_given}
    check_rules(_RULES, given)
    watched = monitor and flown_by.autopilot == "own"
    watcher = _monitor(scenario, chosen.video_port, count) if watched else None
    if watcher is not None:
        chosen = replace(chosen, link=(*chosen.link, watcher.link))
    settings = _settings(chosen, onboard, speed, instance, count)
    caller = started_by or StartedBy()
    server = _server(
        scenario, settings, onboard, fault, flown_by=flown_by, count=count, seed=seed, caller=caller
    )
    asyncio.run(_run(server, watcher, lifeline=caller.lifeline))
    return 0


def _server(
    scenario: str,
    settings: ServerSettings,
    onboard: Onboard,
    fault: tuple[str, ...],
    *,
    flown_by: FlownBy,
    count: int,
    seed: int,
    caller: StartedBy,
) -> _Server:
    """The simulator with the chosen autopilot; only with ours it tells the truth."""
    from scenarios.loader import load_scenario

    grants = caller.grants()
    chosen = with_faults(with_sensors(load_scenario(scenario), onboard.sensors), fault)
    if flown_by.autopilot == "px4":
        return px4_server(
            for_genuine("PX4", chosen),
            settings,
            folder=flown_by.px4,
            transmitter=flown_by.transmitter,
            seed=seed,
            grants=grants,
        )
    if flown_by.autopilot == "ardupilot":
        genuine = for_genuine("ArduPilot", chosen)
        return ardupilot_server(genuine, settings, folder=flown_by.ardupilot, seed=seed, grants=grants)
    from sitl.server import SimulatorServer

    simulations = _simulations(chosen, count=count, seed=seed)
    return SimulatorServer(simulations, settings, notice=say, grants=grants, truth=caller.truth_channel())


def _monitor(scenario: str, video_port: int | None, count: int) -> MonitorProcess:
    from framerunner.child_process import MonitorProcess
    from scenarios.loader import load_scenario

    ports = () if video_port is None else range(video_port, video_port + count)
    return MonitorProcess(load_scenario(scenario), camera_hosts=[f"127.0.0.1:{port}" for port in ports])


def _settings(
    chosen: SimulatorConnections, onboard: Onboard, speed: float, instance: int, count: int
) -> ServerSettings:
    check_range("--video-port", chosen.video_port, 1, 65536 - count)

    from sitl.server_settings import ServerSettings, parse_link, rtp_address

    links = tuple(parse_link(text) for text in chosen.link)
    if count > 1 and any(link.url.scheme == "serial" for link in links):
        raise SettingError(f"--count {count}: a serial line serves one drone; leave it out or use --count 1")
    twice = next((link.url.text for number, link in enumerate(links) if link in links[:number]), None)
    if twice is not None:
        raise SettingError(f"--link {twice}: given twice; leave one out")
    rtp = None
    if chosen.video_rtp != "off" and is_installed("av"):
        rtp = rtp_address(chosen.video_rtp, instance)
    elif chosen.video_rtp != "off":
        say(f"warning: no video in RTP: {install_advice('av')}")
    settings = ServerSettings(
        instance=instance,
        bind=chosen.bind,
        onboard_remote=chosen.onboard_remote,
        ground_remote=chosen.ground_remote,
        video_port=chosen.video_port,
        video_rtp=rtp,
        speed=speed,
        links=links,
        signing_key=_read_key(chosen.signing_key),
        show_layout=chosen.show_layout,
        storage=onboard.storage,
        shell=onboard.shell,
        camera=onboard.camera,
        parameters=onboard.parameters,
    )
    settings.check(count)
    return settings


def _simulations(scenario: Scenario, *, count: int, seed: int) -> list[Simulation]:
    from framerunner.vehicle.airframe import load_airframe
    from sitl.fleet import side_by_side
    from sitl.simulation import Simulation

    if count == 1:
        return [Simulation(scenario, seed=seed)]
    airframe = load_airframe(scenario.airframe)
    try:
        scenarios = side_by_side(scenario, count, max(airframe.envelope_m[:2]))
    except ValueError as error:
        raise SettingError(f"--count {count}: {error}") from error
    return [Simulation(one, airframe, seed) for one in scenarios]


def _read_key(path: Path | None) -> SigningKey | None:
    """Read the key in a file; the file's content is never shown."""
    if path is None:
        return None
    from framerunner.wire.signing import SigningKey

    try:
        return SigningKey.from_text(read_text(path))
    except TextError as error:
        advice = "it must hold 64 hexadecimal digits or a passphrase"
        raise SettingError(f"--signing-key {path}: {error}; {advice}") from None
    except ValueError as error:
        raise SettingError(f"--signing-key {path}: {error}") from None


async def _run(server: _Server, monitor: MonitorProcess | None, *, lifeline: bool) -> None:
    from framerunner.child_process import until_standard_input_ends

    async with AsyncExitStack() as stack:
        if monitor is not None:
            await stack.enter_async_context(monitor)
            await monitor.opened()
        await (until_standard_input_ends(server.run()) if lifeline else server.run())
