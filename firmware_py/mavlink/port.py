"""What the MAVLink services need of an autopilot."""

from __future__ import annotations

from math import nan
from typing import Protocol

from firmware_py.airframe import Airframe
from firmware_py.guidance.orbit import Orbit
from firmware_py.missions.flight import IssuedCommand
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from firmware_py.setpoints import Setpoint
from firmware_py.status import CommandResult, FlightMode, VehicleStatus
from firmware_py.types import (
    BatteryState,
    FlightRecord,
    GeodeticPoint,
    ManualInput,
    MotorOutput,
    StatusText,
    VehicleState,
)
from geometry.vectors import Vec3


class AutopilotPort(Protocol):
    """The outside of `firmware_py.autopilot.Autopilot`, as far as MAVLink reaches."""

    @property
    def airframe(self) -> Airframe:
        """What is flown."""
        ...

    @property
    def parameters(self) -> Parameters:
        """What can be set."""
        ...

    @property
    def state(self) -> VehicleState:
        """What the autopilot believes about the vehicle."""
        ...

    @property
    def status(self) -> VehicleStatus:
        """What the commander says of the vehicle."""
        ...

    @property
    def output(self) -> MotorOutput:
        """What was last sent to the motors."""
        ...

    @property
    def battery(self) -> BatteryState:
        """What is known of the battery."""
        ...

    @property
    def flight(self) -> FlightRecord:
        """Times of the flight now or last."""
        ...

    @property
    def missions(self) -> MissionStore:
        """Mission, fence and rally points."""
        ...

    def arm(self, *, force: bool = False) -> CommandResult:
        """Let the motors turn."""
        ...

    def disarm(self, *, force: bool = False) -> CommandResult:
        """Stop the motors; in the air only by force."""
        ...

    def set_mode(self, mode: FlightMode) -> CommandResult:
        """Ask for a flight mode."""
        ...

    def takeoff(self, altitude_amsl_m: float = nan) -> CommandResult:
        """Take off to an altitude; NaN: MIS_TAKEOFF_ALT above where it is."""
        ...

    def land(self) -> CommandResult:
        """Land here."""
        ...

    def accept_setpoint(self, setpoint: Setpoint) -> None:
        """Take an offboard setpoint just received."""
        ...

    def terminate(self) -> CommandResult:
        """Stop the motors for good, wherever it is."""
        ...

    def reposition(self, target_ned_m: Vec3, yaw_rad: float = nan, speed_m_s: float = nan) -> CommandResult:
        """Fly to a place and hold there; NaN components: as they are."""
        ...

    def orbit(self, orbit: Orbit) -> CommandResult:
        """Circle around a point."""
        ...

    def change_speed(self, speed_m_s: float) -> CommandResult:
        """Fly the present journey at another horizontal speed; NaN: the usual one."""
        ...

    def look_at(self, point_ned_m: Vec3 | None) -> CommandResult:
        """Turn the nose to a place on journeys and in hold; None: no more."""
        ...

    def set_home(self, point: GeodeticPoint | None) -> CommandResult:
        """Set home to a place, or (None) to where the vehicle is."""
        ...

    def set_origin(self, point: GeodeticPoint) -> CommandResult:
        """Say where on Earth the local frame's origin is."""
        ...

    def manual_input(self, sticks: ManualInput) -> None:
        """Take a pilot's sticks."""
        ...

    def ground_station_heard(self) -> None:
        """Note a ground station's heartbeat."""
        ...

    def follow_target(self, position_ned_m: Vec3, velocity_ned_m_s: Vec3) -> None:
        """Take a report of the target to follow, in the local frame."""
        ...

    def take_issued_commands(self) -> list[IssuedCommand]:
        """What the mission commands others since the last call."""
        ...

    def say(self, severity: int, text: str) -> None:
        """Tell people something; MAV_SEVERITY."""
        ...

    def take_texts(self) -> list[StatusText]:
        """What was said since the last call."""
        ...

    def global_position(self) -> GeodeticPoint | None:
        """Where the vehicle is on Earth; None before it is known."""
        ...

    def local_position(self, point: GeodeticPoint) -> Vec3 | None:
        """A place on Earth in the local frame, NED metres; None before the origin is known."""
        ...
