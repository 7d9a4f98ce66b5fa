"""Return: climb, come home, come down, land. Heights follow PX4's cone around home."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import hypot, nan, radians, tan

from firmware_py.guidance.limits import SpeedLimits
from firmware_py.guidance.travel import Traveller
from firmware_py.parameters import Parameters
from firmware_py.types import VehicleState
from geometry.vectors import Vec3

_STEEPEST_DEG = 89.0


@dataclass(frozen=True, slots=True)
class ReturnSettings:
    """Heights above home and distances, metres; the delay in microseconds, negative: for ever."""

    return_altitude_m: float
    descend_altitude_m: float
    cone_deg: float
    near_m: float
    acceptance_m: float
    height_acceptance_m: float
    delay_us: int


def return_settings(parameters: Parameters) -> ReturnSettings:
    """What the RTL_ and NAV_ parameters say."""
    value = parameters.value
    return ReturnSettings(
        value("RTL_RETURN_ALT"),
        value("RTL_DESCEND_ALT"),
        value("RTL_CONE_ANG"),
        value("RTL_MIN_DIST"),
        value("NAV_ACC_RAD"),
        value("NAV_MC_ALT_RAD"),
        round(value("RTL_LAND_DELAY") * 1e6),
    )


def return_height_m(settings: ReturnSettings, distance_m: float, height_m: float) -> float:
    """Height above home to come back at.

    Far away it is RTL_RETURN_ALT; near home a cone spares the climb (PX4 1.17's rule). It never descends for
    the way back, and with no cone it always climbs.

    Args:
        settings: what parameters say.
        distance_m: horizontal distance to home.
        height_m: above home now.
    """
    most_m = settings.return_altitude_m
    if settings.cone_deg <= 0:
        return max(height_m, most_m)
    if distance_m <= settings.acceptance_m:
        wanted_m = 2.0 * distance_m
    else:
        wanted_m = most_m
        if distance_m <= settings.near_m:
            wanted_m = min(wanted_m, distance_m / tan(radians(min(settings.cone_deg, _STEEPEST_DEG))))
        wanted_m = max(wanted_m, 2.0 * settings.acceptance_m)
    return max(height_m, min(wanted_m, most_m))


class Phase(Enum):
    """How far the return has come."""

    CLIMB = "climb"
    TRAVEL = "travel"
    DESCEND = "descend"
    WAIT = "wait"
    LAND = "land"


class ReturnHome:
    """A return, from where it is to the ground at home.

    Attributes:
        phase: how far it has come.
        traveller: flies all but the landing.
    """

    __slots__ = ("_home_ned_m", "_settings", "_wait_since_us", "phase", "traveller")

    def __init__(self, traveller: Traveller) -> None:
        self.phase = Phase.CLIMB
        self.traveller = traveller
        self._home_ned_m: Vec3 = (0.0, 0.0, 0.0)
        self._settings: ReturnSettings | None = None
        self._wait_since_us = 0

    def start(
        self, state: VehicleState, home_ned_m: Vec3, settings: ReturnSettings, limits: SpeedLimits
    ) -> None:
        """Begin here; home is in the local frame, shape (3,)."""
        self._home_ned_m, self._settings = home_ned_m, settings
        self.phase = Phase.CLIMB
        north_m, east_m, down_m = state.position_ned_m
        distance_m = hypot(home_ned_m[0] - north_m, home_ned_m[1] - east_m)
        height_m = return_height_m(settings, distance_m, home_ned_m[2] - down_m)
        self.traveller.start(state, limits)
        self.traveller.go((nan, nan, home_ned_m[2] - height_m), self.traveller.yaw_rad)

    def advance(self, state: VehicleState) -> Phase:
        """Go on to the next phase when this one is done, and say which it is."""
        settings, traveller, home = self._settings, self.traveller, self._home_ned_m
        if settings is None or self.phase is Phase.LAND:
            return self.phase
        if self.phase is Phase.CLIMB and traveller.climb_m(state) < settings.height_acceptance_m:
            self.phase = Phase.TRAVEL
            traveller.go((home[0], home[1], traveller.target_ned_m[2]))
        if self.phase is Phase.TRAVEL and traveller.distance_m(state) < _AT_HOME_M:
            self.phase = Phase.DESCEND
            lowest_m = min(settings.descend_altitude_m, home[2] - state.position_ned_m[2])
            traveller.go((home[0], home[1], home[2] - lowest_m), state.yaw_rad)
        if self.phase is Phase.DESCEND and abs(traveller.climb_m(state)) < settings.height_acceptance_m:
            self.phase = Phase.WAIT
            self._wait_since_us = state.time_us
        waits = settings.delay_us < 0 or state.time_us - self._wait_since_us < settings.delay_us
        if self.phase is Phase.WAIT and not waits:
            self.phase = Phase.LAND
        return self.phase


_AT_HOME_M = 0.5  # a landing goes straight down, so it begins over the place
