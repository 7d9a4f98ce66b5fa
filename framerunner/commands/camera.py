"""`framerunner camera`: the arena's camera image for any drone that reports its pose."""

from __future__ import annotations

import asyncio

from framerunner.commands import WholeNumber, check_range, say


def camera(
    *,
    drone: str = "udpin://127.0.0.1:14550",
    scenario: str = "test-case-1",
    no_base: bool = False,
    level: bool = False,
    bind: str = "127.0.0.1",
    port: WholeNumber = 8100,
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

    Args:
        drone: MAVLink URL on which the drone is heard
        scenario: name or file of the scenario whose frames are seen
        no_base: the drone starts from the floor: there is no base under it
        level: held level, as by a gimbal, whatever the drone's roll and pitch
        bind: address to serve the video on
        port: TCP port of the video
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
