"""`framerunner doctor`: what a drone reports about itself, and what it lacks for the challenge."""

from __future__ import annotations

import asyncio
import time
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from framerunner.commands import within

if TYPE_CHECKING:
    from vision.calibration.model import Calibration


def doctor(
    *,
    drone: str = "udpin://0.0.0.0:14540",
    seconds: Annotated[float, within(2.0, 600.0)] = 6.0,
    camera: str | None = None,
    calibration: Path | None = None,
    walk: Annotated[float | None, within(10.0, 300.0)] = None,
) -> int:
    """Listen to a drone, request its data, and say in one page whether it can fly the challenge.

    Any vehicle with PX4 or ArduPilot, simulated or real. It is never armed and none of its parameters is
    changed; ArduPilot is asked for streams of messages on this link, since it sends none by itself.

    With --camera the rate, size, gaps and delay of its images are measured, and with --calibration it is said
    whether they fit it, how old it is, and whether the camera's mounting on the drone is known.

    With --walk you carry the drone, motors off and without propellers, over the floor that it is to fly over:
    from a mark and back to it. It is said how well optical flow and range finder see this floor, and how far
    the drone's estimate has drifted.

    Exit code 0: it can fly, 1: something is missing, 2: bad input.

    **Examples**

        framerunner doctor

        framerunner doctor --drone udpin://0.0.0.0:14540

        framerunner doctor --drone serial:///dev/ttyUSB0:57600 --seconds 15

        framerunner doctor --drone udpin://0.0.0.0:14540 --walk 40

        framerunner doctor --camera rtsp://10.0.0.2/1 --calibration camera.yaml

    Args:
        drone: MAVLink URL of the drone
        seconds: how long to listen, 2 to 600 s
        camera: URL or device of its camera, as for `fly --camera`: it is watched, too
        calibration: calibration of its camera, a file of `framerunner camera calibrate`
        walk: for how long you carry it about, 10 to 300 s
    """
    from framerunner.camera_calibration.calibration_file import load_calibration
    from vision.sources import open_source

    known = None if calibration is None else load_calibration(calibration)
    if camera is not None:
        open_source(camera)  # says in a line what can be no camera
    return _examine(drone, seconds, camera, known, walk)


def _examine(
    drone: str,
    seconds: float,
    camera: str | None,
    calibration: Calibration | None,
    walk_s: float | None,
) -> int:
    """Listen, watch, and print the page; returns the exit code."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn

    from framerunner.doctor.camera_times import LOOK_S, examine_camera, measure_camera
    from framerunner.doctor.checks import can_fly, examine
    from framerunner.doctor.listen import COMPONENT_ID, SYSTEM_ID, listen
    from framerunner.doctor.page import findings_table, print_page
    from framerunner.doctor.walk import WalkRecord, examine_walk, walk
    from framerunner.wire.session.client import VehicleClient
    from framerunner.wire.session.session import VehicleError
    from framerunner.wire.transports.vehicle_link import VehicleLink

    record, silent = WalkRecord(SYSTEM_ID), ""
    findings = []
    errors, page = Console(stderr=True), Console(highlight=False)
    bar = Progress(TextColumn("{task.description}"), BarColumn(), console=errors, transient=True)
    with closing(VehicleLink(drone, system_id=SYSTEM_ID, component_id=COMPONENT_ID)) as link, bar:
        task = bar.add_task("", total=1.0)

        def show(what: str, share: float) -> None:
            bar.update(task, description=what, completed=share)

        client = VehicleClient(link, record, time.monotonic, show)
        try:
            client.find()
            listen(client, seconds)
            findings = examine(record)
            if walk_s is not None:
                walk(client, record, walk_s)
                findings += examine_walk(record)
        except VehicleError as error:
            silent = str(error)
        times = None
        if camera is not None:
            show("watching the camera", 0.0)
            times = asyncio.run(measure_camera(camera, LOOK_S))
    of_camera = []
    if camera is not None or calibration is not None:
        of_camera = examine_camera(times, calibration, record.clock_ms[-1] if record.clock_ms else None)
    if not silent:
        findings += of_camera
        print_page(page, link.url, record, findings)
        return 0 if can_fly(findings) else 1
    errors.print(silent, highlight=False, soft_wrap=True)
    if of_camera:
        page.print(findings_table(of_camera))
    return 1
