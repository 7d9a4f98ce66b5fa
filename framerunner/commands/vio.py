"""`framerunner vio`: the drone's place by its camera and its IMU, for any MAVLink vehicle."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Annotated

from framerunner.commands import within


def vio(
    camera: str,
    *,
    drone: str = "udpin://0.0.0.0:14540",
    scenario: str = "empty",
    calibration: Path | None = None,
    camera_delay: Annotated[float | None, within(0.0, 1000.0)] = None,
    seconds: Annotated[float | None, within(1.0, 1e6)] = None,
) -> int:
    """Follow points in a drone's images, and send the drone the place that they and its IMU tell.

    The drone stands on the scenario's start when this begins, and no app needs to fly it: a pilot may. It is
    sent ODOMETRY 20 times a second, as `framerunner mocap` sends poses, with the same line each second and
    the same report at the end. Its height is its own, by a range finder. `fly --vio` does this itself; do not
    run both.

    Exit code 0: the drone uses the poses and nothing is wrong, 1: something is missing, 2: bad input.

    **Examples**

        framerunner vio http://127.0.0.1:8100/video --scenario test-case-1

        framerunner vio /dev/video0 --drone serial:///dev/ttyUSB0:921600 --calibration camera.json

    Args:
        camera: URL, device or folder of the drone's images
        drone: MAVLink URL of the drone
        scenario: on whose start the drone stands, with the shapes of its frames, and its camera if there is
            no calibration
        calibration: of the camera, a file of `framerunner camera calibrate`
        camera_delay: milliseconds from exposure to arrival, of images without a time stamp
        seconds: stop after this many seconds; if not given at Ctrl-C
    """
    from rich.console import Console

    from framerunner.camera_calibration.calibration_file import load_calibration
    from framerunner.camera_calibration.camera_delay import delay_of
    from framerunner.editing.places import find_scenario
    from framerunner.flying.detector import true_calibration
    from framerunner.flying.plan import FlightPlan
    from framerunner.mocap.camera_source import CameraPoses, CameraSettings
    from framerunner.mocap.facts import SendSettings
    from framerunner.mocap.run import run_session
    from framerunner.mocap.session import COMPONENT_ID, SYSTEM_ID
    from framerunner.wire.transports.vehicle_link import VehicleLink
    from offboard.link.place_feedback import HEIGHT_STD_M, STD_M, STD_M_S, STD_RAD

    measured = None if calibration is None else load_calibration(calibration)
    plan = FlightPlan(find_scenario(scenario), calibration=measured)
    delay = delay_of(None if camera_delay is None else camera_delay / 1000.0, measured)
    settings = CameraSettings(camera, measured or true_calibration(plan.scenario.camera), delay.age_s)
    sent = SendSettings(
        rate_hz=25.0,
        position_sigma_m=STD_M,
        height_sigma_m=HEIGHT_STD_M,
        attitude_sigma_rad=STD_RAD,
        velocity_sigma_m_s=STD_M_S,
    )
    with (
        closing(VehicleLink(drone, system_id=SYSTEM_ID, component_id=COMPONENT_ID)) as link,
        closing(CameraPoses(settings, plan.surroundings, plan.start_pose)) as poses,
    ):
        fine = run_session(link, poses, sent, seconds, Console(highlight=False))
    return 0 if fine else 1
