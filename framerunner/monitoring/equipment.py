"""Puts together what the monitor needs of the other rooms."""

from __future__ import annotations

from pathlib import Path

from framerunner.flying.plan import FlightPlan
from framerunner.monitoring.run_library import RunFolders
from monitor.ports import Equipment
from scenarios.loader import list_scenarios, load_scenario
from scenarios.models import Scenario
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
        make_referee=lambda flown: FlightPlan(flown).new_referee(),
        open_link=lambda: VehicleLink(drone_url, system_id=SYSTEM_ID, component_id=COMPONENT_ID),
        scenario=scenario,
        list_scenarios=list_scenarios,
        load_scenario=load_scenario,
        runs=RunFolders(runs),
        start_pose=lambda flown: FlightPlan(flown).start_pose,
        camera_hosts=camera_hosts,
    )
