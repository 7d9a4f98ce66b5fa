"""Puts together what the monitor needs of the other rooms."""

from __future__ import annotations

from pathlib import Path

from framerunner.flying.plan import FlightPlan
from framerunner.monitoring.run_library import RunFolders
from framerunner.vehicle_link import VehicleLink
from monitor.ports import Equipment, Link, LinkFailed, Message
from offboard.drone import DroneError
from scenarios.loader import list_scenarios, load_scenario
from scenarios.models import Scenario

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
        open_link=lambda: _MonitorLink(drone_url),
        make_referee=lambda flown: FlightPlan(flown).new_referee(),
        scenario=scenario,
        list_scenarios=list_scenarios,
        load_scenario=load_scenario,
        runs=RunFolders(runs),
        start_pose=lambda flown: FlightPlan(flown).start_pose,
        camera_hosts=camera_hosts,
    )


class _MonitorLink(Link):
    """A vehicle link in the monitor's words."""

    def __init__(self, url: str) -> None:
        self.url = url
        try:
            self._link = VehicleLink(url, system_id=SYSTEM_ID, component_id=COMPONENT_ID)
        except DroneError as error:
            raise LinkFailed(str(error)) from None

    def receive(self, timeout_s: float) -> list[Message]:
        try:
            return self._link.receive(timeout_s)
        except DroneError as error:
            raise LinkFailed(str(error)) from None

    @property
    def host(self) -> str:
        return self._link.host

    def send(self, message: Message) -> None:
        self._link.send(message)

    def close(self) -> None:
        self._link.close()
