"""Modes, states and results of the autopilot, with PX4's and MAVLink's numbers."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, IntEnum

from firmware_py.setpoints import Setpoint, TrajectorySetpoint
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.wire import px4_modes


class FlightMode(Enum):
    """PX4's flight modes that this autopilot flies."""

    MANUAL = px4_modes.MANUAL
    ALTITUDE = px4_modes.ALTITUDE
    POSITION = px4_modes.POSITION
    ORBIT = px4_modes.ORBIT
    TAKEOFF = px4_modes.TAKEOFF
    HOLD = px4_modes.HOLD
    MISSION = px4_modes.MISSION
    RETURN = px4_modes.RETURN
    LAND = px4_modes.LAND
    FOLLOW = px4_modes.FOLLOW
    ACRO = px4_modes.ACRO
    OFFBOARD = px4_modes.OFFBOARD
    STABILIZED = px4_modes.STABILIZED
    TERMINATION = px4_modes.TERMINATION

    @property
    def custom_mode(self) -> int:
        """HEARTBEAT.custom_mode as PX4 packs it."""
        return self.value.custom_mode


NAVIGATION_STATES: dict[FlightMode, int] = {
    mode: mode.value.navigation_state
    for mode in sorted(FlightMode, key=lambda mode: mode.value.navigation_state)
}
"""PX4's navigation state of each mode, as in logs and events, in PX4's order."""


class LandedState(IntEnum):
    """MAV_LANDED_STATE."""

    ON_GROUND = 1
    IN_AIR = 2
    TAKEOFF = 3
    LANDING = 4


class CommandResult(IntEnum):
    """MAV_RESULT."""

    ACCEPTED = 0
    TEMPORARILY_REJECTED = 1
    DENIED = 2
    UNSUPPORTED = 3
    FAILED = 4


@dataclass(slots=True)
class VehicleStatus:
    """The status of the vehicle.

    Attributes:
        armed: motors may turn.
        mode: the mode that is flown; a failsafe may have chosen it.
        intended_mode: the mode last requested by a person or an app.
        landed_state: for EXTENDED_SYS_STATE.
        failsafe: a failsafe is active (system status CRITICAL).
        ready: pre-arm checks of the intended mode pass (system status STANDBY).
        not_ready: why not, as the text of a refused arming; empty when it is ready.
        home: the position at arming (before: at boot); None before the first position.
        home_ned_m: the same in the local frame, shape (3,).
        origin: the local frame's origin on Earth; None before the first position.
        setpoint: followed now.
    """

    armed: bool = False
    mode: FlightMode = FlightMode.HOLD
    intended_mode: FlightMode = FlightMode.HOLD
    landed_state: LandedState = LandedState.ON_GROUND
    failsafe: bool = False
    ready: bool = False
    not_ready: str = ""
    home: GeodeticPoint | None = None
    home_ned_m: Vec3 = (0.0, 0.0, 0.0)
    origin: GeodeticPoint | None = None
    setpoint: Setpoint = field(default_factory=lambda: TrajectorySetpoint(0))
