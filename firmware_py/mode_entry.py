"""What entering each state of the commander means for guidance."""

from __future__ import annotations

from collections.abc import Callable
from math import isnan, nan

from firmware_py.commander_table import FLOWN_MODE, INFO, WARNING, Event, State
from firmware_py.guidance.circles import Orbit
from firmware_py.guidance.modes import Guidance
from firmware_py.navigator import Navigator
from firmware_py.parameters import Parameters
from firmware_py.places import Places
from firmware_py.status import LandedState, VehicleStatus
from firmware_py.types import VehicleState


class ModeEntry:
    """Tells guidance what is flown from now on.

    Args:
        state: the vehicle.
        status: of the vehicle.
        places: origin and home.
        guidance: to be told.
        navigator: flies missions and knows where a return goes.
        parameters: for the height of a take-off.
        say: takes texts for people, with MAV_SEVERITY.

    Attributes:
        takeoff_altitude_m: of the next take-off, above mean sea level; NaN: MIS_TAKEOFF_ALT above home.
        orbit: the circle to fly.
    """

    __slots__ = (
        "_guidance",
        "_navigator",
        "_parameters",
        "_places",
        "_say",
        "_state",
        "_status",
        "orbit",
        "takeoff_altitude_m",
    )

    def __init__(
        self,
        state: VehicleState,
        status: VehicleStatus,
        *,
        places: Places,
        guidance: Guidance,
        navigator: Navigator,
        parameters: Parameters,
        say: Callable[[int, str], None],
    ) -> None:
        self._state = state
        self._status = status
        self._places = places
        self._guidance = guidance
        self._navigator = navigator
        self._parameters = parameters
        self._say = say
        self.takeoff_altitude_m = nan
        self.orbit = Orbit()

    def enter(self, target: State, before: State, event: Event) -> None:
        """Fly another way from now on; entering states without motors changes no guidance.

        Args:
            target: the state entered.
            before: the state left.
            event: what led there.
        """
        guidance, state = self._guidance, self._state
        guidance.home_ned_m = self._status.home_ned_m
        if before is State.MISSION:
            self._navigator.leave_mission()
        match target:
            case State.DISARMED | State.TERMINATED:
                self._navigator.disarmed()
            case State.FAILSAFE_HOLD if before is State.TAKEOFF and self._on_ground:
                pass  # as PX4: a take-off that has begun goes on to its height and holds there
            case State.HOLD | State.FAILSAFE_HOLD:
                reached = before is State.TAKEOFF and event is Event.TICK
                guidance.enter_hold(state, keep_target=reached or event is Event.MISSION_DONE)
            case State.TAKEOFF:
                self._enter_takeoff()
            case State.LAND | State.FAILSAFE_LAND:
                guidance.enter_land(state)
            case State.RETURN | State.FAILSAFE_RETURN:
                guidance.enter_return(state, self._navigator.return_place())
            case State.MISSION:
                guidance.enter_hold(state)
                self._navigator.enter_mission()
            case _:
                self._enter_other(target)

    @property
    def _on_ground(self) -> bool:
        return self._status.landed_state is LandedState.ON_GROUND

    def _enter_other(self, target: State) -> None:
        guidance, state = self._guidance, self._state
        match target:
            case State.OFFBOARD:
                guidance.enter_offboard()
            case State.FAILSAFE_DESCEND:
                guidance.enter_descend(state)
            case State.ORBIT:
                guidance.enter_orbit(state, self.orbit)
            case State.FOLLOW:
                guidance.enter_follow(state)
            case _:
                guidance.enter_sticks(state, FLOWN_MODE[target])

    def _enter_takeoff(self) -> None:
        state = self._state
        here, home = self._places.to_geodetic(state.position_ned_m), self._status.home
        if here is None or home is None:  # cannot be: it is armed, so a position has come
            return
        altitude_m = self.takeoff_altitude_m
        if isnan(altitude_m):
            height_m = self._parameters.value("MIS_TAKEOFF_ALT")
            altitude_m = home.altitude_m + height_m
            self._say(INFO, f"Using default takeoff altitude: {height_m:.1f} m")
        if altitude_m < here.altitude_m:
            self._say(WARNING, "Already higher than takeoff altitude")
        climb_m = altitude_m - here.altitude_m
        self._guidance.enter_takeoff(state, state.position_ned_m[2] - climb_m)
