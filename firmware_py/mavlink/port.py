"""What the MAVLink services need of an autopilot."""

from __future__ import annotations

from math import nan
from typing import Protocol

from firmware_py.airframe import Airframe
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from firmware_py.status import CommandResult, FlightMode, VehicleStatus
from firmware_py.types import (
    BatteryState,
    FlightRecord,
    GeodeticPoint,
    MotorOutput,
    Setpoint,
    StatusText,
    Vec3,
    VehicleState,
)


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
