"""The return mode: climb, come home, come down, land. Heights follow PX4's cone around home."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import hypot, nan, radians, tan

from firmware_py.airframe import Airframe
from firmware_py.commands import ControlCommand
from firmware_py.guidance.mode import JourneyMode, ModeEntry
from firmware_py.parameters import Parameters
from firmware_py.types import VehicleState

_MAX_CONE_DEG = 89.0
_AT_HOME_M = 0.5  # a landing goes straight down, so it begins over the place


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
    max_m = settings.return_altitude_m
    if settings.cone_deg <= 0:
        return max(height_m, max_m)
    if distance_m <= settings.acceptance_m:
        wanted_m = 2.0 * distance_m
    else:
        wanted_m = max_m
        if distance_m <= settings.near_m:
            wanted_m = min(wanted_m, distance_m / tan(radians(min(settings.cone_deg, _MAX_CONE_DEG))))
        wanted_m = max(wanted_m, 2.0 * settings.acceptance_m)
    return max(height_m, min(wanted_m, max_m))


class Phase(Enum):
    """How far the return has come."""

    CLIMB = "climb"
    TRAVEL = "travel"
    DESCEND = "descend"
    WAIT = "wait"
    LAND = "land"


class ReturnMode(JourneyMode):
    """Comes back to a place and lands there."""

    def configure(self, airframe: Airframe, parameters: Parameters) -> None:
        """Take over heights and distances; a return under way keeps its own."""
        self._configured = return_settings(parameters)

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Come back to the entry's target."""
        context, settings = self._context, self._configured
        self._settings, self._place_ned_m = settings, entry.target_ned_m
        self._phase, self._wait_since_us = Phase.CLIMB, 0
        place = entry.target_ned_m
        north_m, east_m, down_m = state.position_ned_m
        distance_m = hypot(place[0] - north_m, place[1] - east_m)
        height_m = return_height_m(settings, distance_m, place[2] - down_m)
        self._begin(state)
        context.traveller.go((nan, nan, place[2] - height_m), context.traveller.yaw_rad)
        self._show_journey(state)

    def step(self, state: VehicleState) -> ControlCommand:
        """Go on to the next phase when this one is done, and fly it."""
        before = self._phase
        self._advance(state)
        if self._phase is not Phase.LAND:
            if self._phase is not before:
                self._show_journey(state)
            return self._travel(state)
        if before is not Phase.LAND:
            traveller = self._context.traveller
            traveller.go((*traveller.target_ned_m[:2], nan), traveller.yaw_rad)
            self._show_journey(state)
        return self._sink(state)

    def _advance(self, state: VehicleState) -> None:
        """Find the phase."""
        settings, traveller, place = self._settings, self._context.traveller, self._place_ned_m
        if self._phase is Phase.LAND:
            return
        if self._phase is Phase.CLIMB and traveller.climb_m(state) < settings.height_acceptance_m:
            self._phase = Phase.TRAVEL
            traveller.go((place[0], place[1], traveller.target_ned_m[2]))
        if self._phase is Phase.TRAVEL and traveller.distance_m(state) < _AT_HOME_M:
            self._phase = Phase.DESCEND
            lowest_m = min(settings.descend_altitude_m, place[2] - state.position_ned_m[2])
            traveller.go((place[0], place[1], place[2] - lowest_m), state.yaw_rad)
        if self._phase is Phase.DESCEND and abs(traveller.climb_m(state)) < settings.height_acceptance_m:
            self._phase = Phase.WAIT
            self._wait_since_us = state.time_us
        waits = settings.delay_us < 0 or state.time_us - self._wait_since_us < settings.delay_us
        if self._phase is Phase.WAIT and not waits:
            self._phase = Phase.LAND
