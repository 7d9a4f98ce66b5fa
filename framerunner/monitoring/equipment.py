"""Puts together what the monitor needs of the other rooms."""

from __future__ import annotations

from pathlib import Path

from firmware_py.airframe import load_airframe
from framerunner.monitoring.run_library import RunFolders
from monitor.ports import Equipment
from scenarios.ground import start_position
from scenarios.loader import list_scenarios, load_scenario
from scenarios.models import Scenario
from scenarios.referee import Referee
from wire.transports.vehicle_link import VehicleLink

SYSTEM_ID = 250  # the doctor has 247, the virtual camera 246, MAVSDK 245, other ground stations 255
COMPONENT_ID = 190  # MAV_COMP_ID_MISSIONPLANNER, which is what ground stations use


def equipment(
    drone_url: str, scenario: Scenario | None, runs: Path, camera_hosts: tuple[str, ...] = ()
) -> Equipment:
    """What the monitor is given.

    Args:
        drone_url: of the link to the drones.
        scenario: what is flown, for a drone that brings no referee.
        runs: folder of flights to show again; it may come to be later.
        camera_hosts: see `Equipment`.
    """
    return Equipment(
        open_link=lambda: VehicleLink(drone_url, system_id=SYSTEM_ID, component_id=COMPONENT_ID),
        make_referee=_referee,
        scenario=scenario,
        list_scenarios=list_scenarios,
        load_scenario=load_scenario,
        runs=RunFolders(runs),
        start_pose=_start_pose,
        camera_hosts=camera_hosts,
    )


def _referee(scenario: Scenario) -> Referee:
    return Referee(scenario, load_airframe(scenario.airframe).envelope_m)


def _start_pose(scenario: Scenario) -> tuple[float, float, float, float]:
    x_m, y_m, ground_m = start_position(scenario)
    height_m = load_airframe(scenario.airframe).envelope_m[2]
    return (x_m, y_m, ground_m + height_m / 2, scenario.start.yaw_rad)
