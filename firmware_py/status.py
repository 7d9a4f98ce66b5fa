"""Modes, states and results of the autopilot, with PX4's and MAVLink's numbers."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, IntEnum

from firmware_py.setpoints import Setpoint, TrajectorySetpoint
from firmware_py.types import GeodeticPoint
from geometry.vectors import Vec3


class FlightMode(Enum):
    """Flight modes with PX4's numbers; the value is (main mode, sub mode)."""

    MANUAL = (1, 0)
    ALTITUDE = (2, 0)
    POSITION = (3, 0)
    ORBIT = (3, 1)
    TAKEOFF = (4, 2)
    HOLD = (4, 3)
    MISSION = (4, 4)
    RETURN = (4, 5)
    LAND = (4, 6)
    FOLLOW = (4, 8)
    ACRO = (5, 0)
    OFFBOARD = (6, 0)
    STABILIZED = (7, 0)
    TERMINATION = (10, 0)

    @property
    def custom_mode(self) -> int:
        """HEARTBEAT.custom_mode as PX4 packs it: main << 16 | sub << 24."""
        main, sub = self.value
        return int(main) << 16 | int(sub) << 24


NAVIGATION_STATES: dict[FlightMode, int] = {
    FlightMode.MANUAL: 0,
    FlightMode.ALTITUDE: 1,
    FlightMode.POSITION: 2,
    FlightMode.MISSION: 3,
    FlightMode.HOLD: 4,
    FlightMode.RETURN: 5,
    FlightMode.ACRO: 10,
    FlightMode.TERMINATION: 13,
    FlightMode.OFFBOARD: 14,
    FlightMode.STABILIZED: 15,
    FlightMode.TAKEOFF: 17,
    FlightMode.LAND: 18,
    FlightMode.FOLLOW: 19,
    FlightMode.ORBIT: 21,
}
"""PX4's number of each mode inside (its navigation state), as logs and events have it."""


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
    """What the commander says of the vehicle.

    Attributes:
        armed: motors may turn.
        mode: the mode flown now (a failsafe may have chosen it).
        intended_mode: the mode last asked for by a person or an app.
        landed_state: for EXTENDED_SYS_STATE.
        failsafe: a failsafe is in charge (system status CRITICAL).
        ready: pre-arm checks of the intended mode pass (system status STANDBY).
        not_ready: why not, in the words that would refuse to arm it; empty when it is ready.
        home: where it was armed (first: where it booted); None before the first position.
        home_ned_m: the same in the local frame, shape (3,).
        origin: the local frame's origin on Earth; None before the first position.
        setpoint: what is followed now.
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
