"""Guidance: what each flight mode asks of the stabiliser.

Most modes turn the vehicle's state into a velocity and a yaw rate. Positions are reached by a proportional
loop to velocity, as PX4's position controller does it; the stabiliser does the rest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import atan2, cos, hypot, isnan, nan, pi, remainder, sin, tau

from firmware_py.airframe import Airframe
from firmware_py.estimator import euler_angles
from firmware_py.guidance.circles import FollowSettings, Orbit, TargetFollower, follow_settings
from firmware_py.guidance.limits import SpeedLimits, clamp, speed_limits
from firmware_py.guidance.offboard import acceleration_or_zero, bounded, is_acceleration_only, usable
from firmware_py.guidance.returning import Phase, ReturnHome, ReturnSettings, return_settings
from firmware_py.guidance.station import StationKeeper, towards
from firmware_py.guidance.sticks import StickFlight, StickSettings, stick_settings
from firmware_py.guidance.travel import Traveller, passing_speed
from firmware_py.missions.flight import Leg, LegKind
from firmware_py.parameters import Parameters
from firmware_py.status import FlightMode
from firmware_py.types import (
    AccelerationCommand,
    ActuatorCommand,
    BodyRateCommand,
    Command,
    ManualInput,
    RateCommand,
    Setpoint,
    TiltCommand,
    Vec3,
    VehicleState,
)

__all__ = ["Guidance", "SpeedLimits", "bounded", "speed_limits", "usable"]

_REACHED_M = 0.15
_FACING_M = 0.5  # nearer than this, a region of interest says nothing about where to look
_TARGET_LOST_US = 3_000_000
_CENTRED = ManualInput(0)
_TO_HOME, _FROM_HOME = 1, 2  # MPC_YAW_MODE
_HOME_YAW = (_TO_HOME, _FROM_HOME)


@dataclass(slots=True)
class Manners:
    """How modes behave that parameters describe.

    Attributes:
        sticks: what full sticks mean.
        returning: heights and distances of a return.
        following: how a target is followed.
        yaw_mode: MPC_YAW_MODE: 1 towards home, 2 away from it, else along the way.
    """

    sticks: StickSettings
    returning: ReturnSettings
    following: FollowSettings
    yaw_mode: int = 0


def manners(airframe: Airframe, parameters: Parameters) -> Manners:
    """What airframe and parameters say."""
    return Manners(
        stick_settings(airframe, parameters),
        return_settings(parameters),
        follow_settings(parameters),
        parameters.integer("MPC_YAW_MODE"),
    )


class Guidance:
    """All flight modes' guidance with what they remember.

    Attributes:
        limits: speeds, accelerations and gains.
        setpoint: what is followed now, for telemetry.
        target_reached: whether the take-off is at its height.
        command_down_m_s: vertical speed now asked for; for a thrust, its sign.
        sticks: a pilot's newest input.
        home_ned_m: shape (3,); heights of return, landing and following count from it.
        region_ned_m: what to look at on journeys; None: nothing.
        traveller: flies journeys.
        returning: flies the return.
        follower: knows the target to follow.
    """

    __slots__ = (
        "_keeper",
        "_manners",
        "_offboard",
        "_orbit",
        "_period_s",
        "_step",
        "_stick_flight",
        "_turning",
        "command_down_m_s",
        "follower",
        "home_ned_m",
        "limits",
        "region_ned_m",
        "returning",
        "setpoint",
        "sticks",
        "target_reached",
        "traveller",
    )

    def __init__(self, limits: SpeedLimits, manners: Manners | None = None, period_s: float = 0.004) -> None:
        self.limits = limits
        self.setpoint = Setpoint(0)
        self.target_reached = False
        self.command_down_m_s = 0.0
        self.sticks = _CENTRED
        self.home_ned_m: Vec3 = (0.0, 0.0, 0.0)
        self.region_ned_m: Vec3 | None = None
        self.traveller = Traveller()
        self.returning = ReturnHome(self.traveller)
        self.follower = TargetFollower()
        self._period_s = period_s
        self._keeper = StationKeeper()
        self._orbit = Orbit()
        self._offboard = Setpoint(0)
        self._turning: RateCommand | None = None  # the same for every tick of a setpoint
        self._step: Callable[[VehicleState], Command] = self._hold
        self._manners = manners
        self._stick_flight: StickFlight | None = None
        if manners is not None:
            self.configure(limits, manners)

    def configure(self, limits: SpeedLimits, manners: Manners) -> None:
        """Take over changed parameters."""
        self.limits, self._manners = limits, manners
        if self._stick_flight is None:
            self._stick_flight = StickFlight(self._keeper, manners.sticks)
        self._stick_flight.settings = manners.sticks

    def enter_hold(self, state: VehicleState, *, keep_target: bool = False) -> None:
        """Hold place and yaw, or go on to the present target (after a take-off)."""
        self._step = self._hold
        if not keep_target:
            self._keeper.release(state)
        self._show_target(state)

    def enter_takeoff(self, state: VehicleState, target_down_m: float) -> None:
        """Climb straight up to a height; one below the present height means to stay."""
        self._step = self._takeoff
        north_m, east_m, down_m = state.position_ned_m
        self._keeper.yaw_rad = state.yaw_rad
        self._keeper.target_ned_m = (north_m, east_m, min(down_m, target_down_m))
        self.target_reached = False
        self._show_target(state)

    def enter_land(self, state: VehicleState) -> None:
        """Descend; horizontally brake and hold."""
        self._step = self._land
        self._keeper.release(state)
        self._show_target(state)

    def enter_descend(self, state: VehicleState) -> None:
        """Descend level, without a position to hold."""
        self._step = self._descend
        self._keeper.yaw_rad = state.yaw_rad

    def enter_offboard(self) -> None:
        """Follow the setpoints of `accept`."""
        self._step = self._follow_setpoint
        self.setpoint = self._offboard

    def enter_sticks(self, state: VehicleState, mode: FlightMode) -> None:
        """Fly by hand."""
        steps: dict[FlightMode, Callable[[VehicleState], Command]] = {
            FlightMode.POSITION: self._sticks_position,
            FlightMode.ALTITUDE: self._sticks_altitude,
            FlightMode.ACRO: self._sticks_acro,
        }
        self._step = steps.get(mode, self._sticks_stabilized)
        self._keeper.release(state)
        self._show_target(state)

    def enter_journey(
        self, state: VehicleState, target_ned_m: Vec3, yaw_rad: float = nan, speed_m_s: float = nan
    ) -> None:
        """Fly to a place and stay there; NaN: yaw along the way, cruising speed."""
        if self._step != self._travel:
            self.traveller.start(state)
        self._step = self._travel
        self.head_for(state, target_ned_m, yaw_rad, speed_m_s)

    def head_for(
        self, state: VehicleState, target_ned_m: Vec3, yaw_rad: float = nan, speed_m_s: float = nan
    ) -> None:
        """Change where the journey goes; the velocity goes on smoothly."""
        traveller = self.traveller
        traveller.target_ned_m, traveller.yaw_rad, traveller.speed_m_s = target_ned_m, yaw_rad, speed_m_s
        traveller.pass_m_s = 0.0
        self._show_journey(state)

    def follow_leg(self, state: VehicleState, leg: Leg) -> None:
        """Fly a leg of a mission."""
        if leg.kind is LegKind.TAKEOFF:
            self.enter_takeoff(state, leg.target_ned_m[2])
        elif leg.kind is LegKind.LAND:
            self.enter_land(state)
            self._keeper.target_ned_m = (leg.target_ned_m[0], leg.target_ned_m[1], nan)
        else:
            self.enter_journey(state, leg.target_ned_m, leg.yaw_rad, leg.speed_m_s)
            if leg.next_ned_m is not None:
                cruise_m_s = self.limits.cruise_m_s if isnan(leg.speed_m_s) else leg.speed_m_s
                self.traveller.pass_m_s = passing_speed(
                    state.position_ned_m, leg.target_ned_m, leg.next_ned_m, cruise_m_s
                )

    def enter_return(self, state: VehicleState, place_ned_m: Vec3 | None = None) -> None:
        """Climb, come home or to another place, shape (3,), land."""
        if self._manners is None:
            raise RuntimeError("guidance is not configured; call configure()")
        self._step = self._return
        self.returning.start(state, place_ned_m or self.home_ned_m, self._manners.returning)
        self._show_journey(state)

    def enter_orbit(self, state: VehicleState, orbit: Orbit) -> None:
        """Circle around a point."""
        self._step = self._circle
        orbit.initial_yaw_rad = state.yaw_rad
        self._orbit = orbit
        self.setpoint = Setpoint(state.time_us, position_ned_m=orbit.centre_ned_m)

    def enter_follow(self, state: VehicleState) -> None:
        """Follow the target that reports itself; until it does, stay."""
        self._step = self._follow_target
        self.traveller.start(state)
        self._keeper.release(state)
        self._show_target(state)

    def accept(self, setpoint: Setpoint) -> None:
        """Take the next offboard setpoint; see `usable` and `bounded`."""
        only_acceleration = is_acceleration_only(setpoint)
        self._offboard = wanted = bounded(setpoint, self.limits)
        self._turning = None
        if only_acceleration:
            self._offboard = wanted = Setpoint(
                setpoint.time_us,
                acceleration_ned_m_s2=acceleration_or_zero(wanted),
                yaw_rad=wanted.yaw_rad,
                yaw_rate_rad_s=wanted.yaw_rate_rad_s,
            )
        elif not isnan(wanted.velocity_level_m_s[0]) and isnan(wanted.yaw_rad):
            yaw_rate_rad_s = self._yaw_rate(0.0, nan, wanted.yaw_rate_rad_s)
            self._turning = RateCommand(wanted.velocity_level_m_s, yaw_rate_rad_s)
        if self._step == self._follow_setpoint:
            self.setpoint = self._offboard

    def step(self, state: VehicleState) -> Command:
        """What the stabiliser has to follow in this tick."""
        command = self._step(state)
        self.command_down_m_s = (
            command.velocity_level_m_s[2] if type(command) is RateCommand else self._intent(command)
        )
        return command

    def _intent(self, command: Command) -> float:
        """Whether a command without a velocity means to go up (below zero) or down."""
        if isinstance(command, RateCommand):
            return command.velocity_level_m_s[2]
        if isinstance(command, AccelerationCommand):
            return command.acceleration_level_m_s2[2]
        if isinstance(command, ActuatorCommand):
            return -1.0 if max(command.outputs, default=0.0) > 0.0 else 1.0
        if isinstance(command, TiltCommand) and isnan(command.thrust):
            return command.down_m_s
        hover = self._stick_flight.settings.hover_thrust if self._stick_flight is not None else 0.5
        return _LITTLE * hover - command.thrust

    def _hold(self, state: VehicleState) -> Command:
        keeper = self._keeper
        before = keeper.target_ned_m
        keeper.latch(state)
        if keeper.target_ned_m is not before:
            self._show_target(state)
        return self._command(state, keeper.velocity(state, self.limits), self._look(state, keeper.yaw_rad))

    def _takeoff(self, state: VehicleState) -> Command:
        keeper = self._keeper
        north_m_s, east_m_s, down_m_s = keeper.velocity(state, self.limits)
        self.target_reached = abs(keeper.target_ned_m[2] - state.position_ned_m[2]) < _REACHED_M
        down_m_s = max(down_m_s, -self.limits.takeoff_m_s)
        return self._command(state, (north_m_s, east_m_s, down_m_s), keeper.yaw_rad)

    def _land(self, state: VehicleState) -> Command:
        keeper = self._keeper
        keeper.latch(state)
        north_m_s, east_m_s, _ = keeper.velocity(state, self.limits)
        height_m = self.home_ned_m[2] - state.position_ned_m[2]
        return self._command(state, (north_m_s, east_m_s, self.limits.landing_m_s(height_m)), keeper.yaw_rad)

    def _descend(self, state: VehicleState) -> Command:
        yaw_rate_rad_s = self._yaw_rate(state.yaw_rad, self._keeper.yaw_rad, nan)
        return TiltCommand(0.0, 0.0, yaw_rate_rad_s, nan, self.limits.land_m_s)

    def _travel(self, state: VehicleState) -> Command:
        velocity_ned_m_s, yaw_rad = self.traveller.step(state, self.limits, self._period_s)
        if (
            self._manners is not None
            and self._manners.yaw_mode in _HOME_YAW
            and isnan(self.traveller.yaw_rad)
        ):
            yaw_rad = self._yaw_by_home(state, yaw_rad)
        return self._command(state, velocity_ned_m_s, self._look(state, yaw_rad), slow=True)

    def _yaw_by_home(self, state: VehicleState, yaw_rad: float) -> float:
        """Towards home or away from it, as MPC_YAW_MODE says."""
        north_m = self.home_ned_m[0] - state.position_ned_m[0]
        east_m = self.home_ned_m[1] - state.position_ned_m[1]
        mode = 0 if self._manners is None else self._manners.yaw_mode
        if mode not in _HOME_YAW or hypot(north_m, east_m) < _FACING_M:
            return yaw_rad
        return atan2(east_m, north_m) + (0.0 if mode == _TO_HOME else pi)

    def _return(self, state: VehicleState) -> Command:
        before = self.returning.phase
        phase = self.returning.advance(state)
        if phase is Phase.LAND:
            if before is not Phase.LAND:
                self._keeper.yaw_rad = state.yaw_rad
                self._keeper.target_ned_m = (*self.traveller.target_ned_m[:2], nan)
                self._show_target(state)
            return self._land(state)
        if phase is not before:
            self._show_journey(state)
        return self._travel(state)

    def _circle(self, state: VehicleState) -> Command:
        orbit = self._orbit
        north_m_s, east_m_s, yaw_rad = orbit.step(state)
        down_m_s = self.limits.height_gain * (orbit.centre_ned_m[2] - state.position_ned_m[2])
        down_m_s = clamp(down_m_s, -self.limits.auto_up_m_s, self.limits.auto_down_m_s)
        return self._command(state, (north_m_s, east_m_s, down_m_s), yaw_rad)

    def _follow_target(self, state: VehicleState) -> Command:
        manners = self._manners
        if manners is None or state.time_us - self.follower.seen_us > _TARGET_LOST_US:
            return self._hold(state)
        place, yaw_rad = self.follower.place(state.time_us, manners.following, self.home_ned_m[2])
        self.traveller.target_ned_m, self.traveller.yaw_rad = place, yaw_rad
        velocity_ned_m_s, yaw_rad = self.traveller.step(state, self.limits, self._period_s)
        north_m_s, east_m_s, _ = self.follower.velocity_ned_m_s
        self._keeper.release(state)
        moving = (velocity_ned_m_s[0] + north_m_s, velocity_ned_m_s[1] + east_m_s, velocity_ned_m_s[2])
        return self._command(state, moving, yaw_rad)

    def _sticks_position(self, state: VehicleState) -> Command:
        flight = self._stick_flight
        return self._hold(state) if flight is None else flight.position(state, self.sticks, self.limits)

    def _sticks_altitude(self, state: VehicleState) -> Command:
        flight = self._stick_flight
        return self._hold(state) if flight is None else flight.altitude(state, self.sticks, self.limits)

    def _sticks_stabilized(self, state: VehicleState) -> Command:
        flight = self._stick_flight
        return self._hold(state) if flight is None else flight.stabilized(self.sticks)

    def _sticks_acro(self, state: VehicleState) -> Command:
        flight = self._stick_flight
        return self._hold(state) if flight is None else flight.acro(self.sticks)

    def _follow_setpoint(self, state: VehicleState) -> Command:
        if self._turning is not None:
            return self._turning
        wanted = self._offboard
        if not isnan(wanted.velocity_level_m_s[0]):
            yaw_rate_rad_s = self._yaw_rate(state.yaw_rad, wanted.yaw_rad, wanted.yaw_rate_rad_s)
            return RateCommand(wanted.velocity_level_m_s, yaw_rate_rad_s)
        if not isnan(wanted.thrust) or wanted.outputs:
            return self._follow_thrust(state, wanted)
        if isnan(wanted.velocity_ned_m_s[0]):
            return AccelerationCommand(
                level(state, acceleration_or_zero(wanted)),
                self._yaw_rate(state.yaw_rad, wanted.yaw_rad, wanted.yaw_rate_rad_s),
            )
        velocity_ned_m_s = towards(
            wanted.position_ned_m, state.position_ned_m, wanted.velocity_ned_m_s, self.limits
        )
        return self._command(state, velocity_ned_m_s, wanted.yaw_rad, wanted.yaw_rate_rad_s)

    def _follow_thrust(self, state: VehicleState, wanted: Setpoint) -> Command:
        """Setpoints below the velocity: attitude, rates, motors."""
        if wanted.outputs:
            return ActuatorCommand(wanted.outputs)
        if wanted.rate_frd_rad_s is not None and wanted.attitude is None:
            return BodyRateCommand(wanted.rate_frd_rad_s, wanted.thrust)
        roll_rad, pitch_rad, yaw_rad = euler_angles(wanted.attitude or state.attitude)
        yaw_rate_rad_s = self._yaw_rate(state.yaw_rad, yaw_rad, wanted.yaw_rate_rad_s)
        return TiltCommand(roll_rad, pitch_rad, yaw_rate_rad_s, wanted.thrust)

    def _command(
        self,
        state: VehicleState,
        velocity_ned_m_s: Vec3,
        yaw_rad: float,
        yaw_rate_rad_s: float = nan,
        *,
        slow: bool = False,
    ) -> RateCommand:
        """Limit a velocity, turn it into level axes, and find the yaw rate that turns the shortest way."""
        velocity_m_s = level(state, self.limits.clip(*velocity_ned_m_s))
        turn_rad_s = self._yaw_rate(state.yaw_rad, yaw_rad, yaw_rate_rad_s)
        if slow:
            most_rad_s = self.limits.auto_yaw_rate_rad_s
            turn_rad_s = clamp(turn_rad_s, -most_rad_s, most_rad_s)
        return RateCommand(velocity_m_s, turn_rad_s)

    def _look(self, state: VehicleState, yaw_rad: float) -> float:
        """Towards the region of interest if there is one."""
        if self.region_ned_m is None:
            return yaw_rad
        north_m = self.region_ned_m[0] - state.position_ned_m[0]
        east_m = self.region_ned_m[1] - state.position_ned_m[1]
        return atan2(east_m, north_m) if hypot(north_m, east_m) > _FACING_M else yaw_rad

    def _yaw_rate(self, yaw_now_rad: float, yaw_rad: float, yaw_rate_rad_s: float) -> float:
        rate_rad_s = 0.0 if isnan(yaw_rate_rad_s) else yaw_rate_rad_s
        if not isnan(yaw_rad):
            rate_rad_s += self.limits.yaw_gain * remainder(yaw_rad - yaw_now_rad, tau)
        limit_rad_s = self.limits.yaw_rate_rad_s
        return clamp(rate_rad_s, -limit_rad_s, limit_rad_s)

    def _show_target(self, state: VehicleState) -> None:
        keeper = self._keeper
        self.setpoint = Setpoint(state.time_us, position_ned_m=keeper.target_ned_m, yaw_rad=keeper.yaw_rad)

    def _show_journey(self, state: VehicleState) -> None:
        traveller = self.traveller
        self.setpoint = Setpoint(
            state.time_us, position_ned_m=traveller.target_ned_m, yaw_rad=traveller.yaw_rad
        )


_LITTLE = 0.7  # less than this share of the thrust that carries the weight means to go down


def level(state: VehicleState, vector_ned: Vec3) -> Vec3:
    """A vector NED in level axes turned with the yaw: forward, right, down."""
    north, east, down = vector_ned
    cos_yaw, sin_yaw = cos(state.yaw_rad), sin(state.yaw_rad)
    return (cos_yaw * north + sin_yaw * east, cos_yaw * east - sin_yaw * north, down)
