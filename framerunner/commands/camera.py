"""`framerunner camera`: the arena's camera image for any drone that reports its pose."""

from __future__ import annotations

import asyncio
from typing import Annotated

from cyclopts import Parameter

from framerunner.commands import WholeNumber, check_range, say


def camera(
    *,
    drone: Annotated[
        str, Parameter(help="MAVLink URL on which the drone is heard")
    ] = "udpin://127.0.0.1:14550",
    scenario: Annotated[
        str, Parameter(help="name or file of the scenario whose frames are seen")
    ] = "test-case-1",
    no_base: Annotated[
        bool, Parameter(help="the drone starts from the floor: there is no base under it")
    ] = False,
    level: Annotated[
        bool, Parameter(help="held level, as by a gimbal, whatever the drone's roll and pitch")
    ] = False,
    bind: Annotated[str, Parameter(help="address to serve the video on")] = "127.0.0.1",
    port: Annotated[WholeNumber, Parameter(help="TCP port of the video")] = 8100,
) -> int:
    """Render what a camera on a drone would see of the arena, from the pose that the drone reports.

    For a drone without frames around it: a genuine PX4 SITL, or a real drone in an empty hall. Put it on
    its start and start this while it is disarmed: the arena is placed so that the drone stands on the
    scenario's start with the start's heading, whatever its compass says. Video and `/referee.json` are
    those of `framerunner sim`. Stop it with Ctrl-C.

    **Examples**

        framerunner camera --scenario test-case-1

        framerunner camera --scenario test-case-1 --no-base --port 8081

        framerunner camera --drone serial:///dev/ttyUSB1:921600 --bind 0.0.0.0
    """
    check_range("--port", port, 1, 65535)

    from framerunner.virtual_camera.camera import VirtualCamera
    from framerunner.virtual_camera.server import COMPONENT_ID, SYSTEM_ID, CameraServer
    from scenarios.loader import load_scenario
    from sitl.video import VideoServer
    from wire.transports.vehicle_link import VehicleLink

    loaded = load_scenario(scenario)
    link = VehicleLink(drone, system_id=SYSTEM_ID, component_id=COMPONENT_ID)
    virtual = VirtualCamera(loaded, level=level, base=not no_base)
    asyncio.run(CameraServer(virtual, link, VideoServer(bind, port), say).run())
    return 0
