"""`framerunner fly`: a mission from take-off to verdict."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from framerunner.commands.options import WholeNumber
from framerunner.errors import SettingError


def fly(
    scenario: Annotated[str, Parameter(help="name or file of the scenario")] = "test-case-1",
    *,
    mission: Annotated[str, Parameter(help="name or file of the mission")] = "frame_challenge",
    drone: Annotated[
        str | None,
        Parameter(help="MAVLink URL of a drone that is there; without it a simulated one is started"),
    ] = None,
    camera: Annotated[
        str | None, Parameter(help="URL, device or folder of its camera; needed with --drone")
    ] = None,
    speed: Annotated[float, Parameter(help="of the simulated drone: simulated seconds a second")] = 1.0,
    instance: Annotated[WholeNumber, Parameter(help="of the simulated drone: shifts its ports, 0 to 9")] = 0,
    lockstep: Annotated[
        bool,
        Parameter(
            negative=(), help="in simulated time, as fast as the machine can, the same each time; no log"
        ),
    ] = False,
    out: Annotated[Path, Parameter(help="folder in which this flight's folder is made")] = Path("runs"),
) -> int:
    """Fly a mission, show it live, and leave result, track, log and video in `runs/<time>-<scenario>/`.

    Exit code 0: completed, 1: flown but not completed, 2: bad input.

    **Examples**

        framerunner fly test-case-1

        framerunner fly my_scenario.yaml --mission soft_landing --speed 2

        framerunner fly test-case-1 --lockstep

        framerunner fly test-case-1 --drone udpin://0.0.0.0:14540 --camera http://127.0.0.1:8080/video

        framerunner fly test-case-1 --drone serial:///dev/ttyUSB0:57600 --camera rtsp://192.168.1.10/live
    """
    _check(drone, camera, speed, instance, lockstep)

    from framerunner.flight import FlightSettings, fly_once
    from offboard.mission import load_mission
    from scenarios.loader import load_scenario

    settings = FlightSettings(
        scenario=load_scenario(scenario),
        mission=load_mission(mission),
        drone_url=drone,
        camera_url=camera,
        speed=speed,
        instance=instance,
        out=out,
        lockstep=lockstep,
    )
    return asyncio.run(fly_once(settings))


def _check(drone: str | None, camera: str | None, speed: float, instance: int, lockstep: bool) -> None:
    """Refuse options that do not go together."""
    if drone is not None and camera is None:
        raise SettingError("--camera: a drone given by --drone needs the URL of its camera too")
    if drone is None and camera is not None:
        raise SettingError("--drone: a camera given by --camera needs the URL of its drone too")
    if drone is not None and (speed != 1.0 or instance != 0):
        raise SettingError("--speed and --instance are for the simulated drone; leave them out with --drone")
    if lockstep and (drone is not None or speed != 1.0 or instance != 0):
        raise SettingError("--lockstep: flies a simulated drone in this process; leave out the others")
    if not 0.01 <= speed <= 100:
        raise SettingError(f"--speed {speed:g}: must be from 0.01 to 100")
    if not 0 <= instance <= 9:
        raise SettingError(f"--instance {instance}: must be from 0 to 9")
