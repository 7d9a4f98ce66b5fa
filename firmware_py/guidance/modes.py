"""Guidance: what each flight mode asks of the stabiliser.

Most modes lead a point that moves smoothly (`reference`), and ask for the velocity that follows it; the
stabiliser does the rest. Offboard setpoints and sticks have modules of their own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import atan2, hypot, isnan, nan

from firmware_py.airframe import Airframe
from firmware_py.guidance.circles import Orbit, OrbitYaw
from firmware_py.guidance.following import FollowSettings, TargetFollower, follow_settings
from firmware_py.guidance.frames import level, rate_command, towards, yaw_rate
from firmware_py.guidance.limits import SpeedLimits, clamp, speed_limits
from firmware_py.guidance.offboard import OffboardFlight, bounded, usable
from firmware_py.guidance.returning import Phase, ReturnHome, ReturnSettings, return_settings
from firmware_py.guidance.sticks import StickFlight, StickSettings, stick_settings
from firmware_py.guidance.travel import Traveller, YawMode, passing_speed
from firmware_py.lift_off import ClimbRamp
from firmware_py.missions.flight import Leg, LegKind
from firmware_py.parameters import Parameters
from firmware_py.status import FlightMode
from firmware_py.types import (
    AccelerationCommand,
    ActuatorCommand,
    Command,
    ManualInput,
    RateCommand,
    Setpoint,
    TiltCommand,
    VehicleState,
)
from geometry.vectors import NAN3, Vec3

__all__ = ["Guidance", "SpeedLimits", "bounded", "speed_limits", "usable"]

_REACHED_M = 0.15
_FACING_M = 0.5  # nearer than this, a region of interest says nothing about where to look
_LITTLE = 0.7  # less than this share of the thrust that carries the weight means to go down
_ABOVE_M = 0.5  # a place so much higher is flown to from the ground
_RAMP_FROM_M_S = -2.45  # PX4's: without thrust, g over its velocity gain
_WOUND_UP_M_S = 0.95  # fitted to heights of x500 flights: PX4's velocity loop winds up during the ramp
_CATCHING_UP = 1.2  # of MPC_Z_V_AUTO_UP: what PX4 leaves modes that fly by themselves
_COUNTED_ON_US = 5_000_000  # so long a velocity made of accelerations is good enough to brake by
_CENTRED = ManualInput(0)


@dataclass(slots=True)
class Manners:
    """How modes behave that parameters describe.

    Attributes:
        sticks: what full sticks mean.
        returning: heights and distances of a return.
        following: how a target is followed.
        yaw_mode: where to look on journeys.
    """

    sticks: StickSettings
    returning: ReturnSettings
    following: FollowSettings
    yaw_mode: YawMode = YawMode.TO_PLACE


def manners(airframe: Airframe, parameters: Parameters) -> Manners:
    """What airframe and parameters say."""
    return Manners(
        stick_settings(airframe, parameters),
        return_settings(parameters),
        follow_settings(parameters),
        YawMode(parameters.integer("MPC_YAW_MODE")),
    )


class Guidance:
    """All flight modes' guidance with what they remember.

    Args:
        limits: speeds, accelerations and gains.
        manners: what parameters say of the modes.
        period_s: of control.

    Attributes:
        limits: see above.
        setpoint: what is followed now, for telemetry.
        target_reached: whether the take-off is at its height.
        command_down_m_s: vertical speed now asked for; for a thrust, its sign.
        sticks: a pilot's newest input.
        region_ned_m: what to look at on journeys, shape (3,); None: nothing.
        traveller: flies journeys, and holds.
        returning: flies the return.
        follower: knows the target to follow.
    """

    __slots__ = (
        "_blind_us",
        "_climb_m_s",
        "_manners",
        "_offboard",
        "_orbit",
        "_period_s",
        "_shown_ned_m",
        "_step",
        "_stick_flight",
        "_takeoff_ned_m",
        "_yaw_rad",
        "command_down_m_s",
        "follower",
        "limits",
        "region_ned_m",
        "returning",
        "setpoint",
        "sticks",
        "target_reached",
        "traveller",
    )

    def __init__(self, limits: SpeedLimits, manners: Manners, period_s: float = 0.004) -> None:
        self.limits = limits
        self.setpoint = Setpoint(0)
        self.target_reached = False
        self.command_down_m_s = 0.0
        self.sticks = _CENTRED
        self.region_ned_m: Vec3 | None = None
        self.traveller = Traveller()
        self.returning = ReturnHome(self.traveller)
        self.follower = TargetFollower()
        self._period_s = period_s
        self._orbit = Orbit()
        self._offboard = OffboardFlight()
        self._stick_flight = StickFlight(manners.sticks, period_s)
        self._shown_ned_m = NAN3  # the target that `setpoint` tells
        self._takeoff_ned_m = NAN3
        self._yaw_rad = 0.0
        self._blind_us = 0
        self._climb_m_s = 0.0  # of a take-off
        self._step: Callable[[VehicleState], Command] = self._travel
        self.configure(limits, manners)

    @property
    def home_ned_m(self) -> Vec3:
        """Heights of return, landing and following count from it, shape (3,)."""
        return self.traveller.heading.home_ned_m

    @home_ned_m.setter
    def home_ned_m(self, home_ned_m: Vec3) -> None:
        self.traveller.heading.home_ned_m = self._stick_flight.home_ned_m = home_ned_m

    def configure(self, limits: SpeedLimits, manners: Manners) -> None:
        """Take over changed parameters."""
        self.limits, self._manners = limits, manners
        self._stick_flight.settings = manners.sticks
        self.traveller.heading.mode = manners.yaw_mode
        self.follower.settings = manners.following

    def enter_hold(self, state: VehicleState, *, keep_target: bool = False) -> None:
        """Brake and hold place and yaw, or go on to the present target (after a take-off or a mission)."""
        lifts = self._step == self._takeoff
        if not keep_target or lifts or self._step != self._travel:
            self._begin(state, self._travel)
            if keep_target and lifts:
                self.traveller.go(self._takeoff_ned_m, self._yaw_rad)
        self._show_journey(state)

    def enter_takeoff(self, state: VehicleState, target_down_m: float) -> None:
        """Climb straight up to a height; one below the present height means to stay."""
        self._step = self._takeoff
        north_m, east_m, down_m = state.position_ned_m
        self._takeoff_ned_m = (north_m, east_m, min(down_m, target_down_m))
        self._yaw_rad = state.yaw_rad
        self._climb_m_s = max(0.0, -state.velocity_ned_m_s[2])
        self.target_reached = False
        self.setpoint = Setpoint(state.time_us, self._takeoff_ned_m, yaw_rad=self._yaw_rad)

    def enter_land(self, state: VehicleState, north_m: float = nan, east_m: float = nan) -> None:
        """Descend, at a place or (NaN) where it stops."""
        self._begin(state, self._land)
        self.traveller.go((north_m, east_m, nan), self.traveller.yaw_rad)
        self._show_journey(state)

    def enter_descend(self, state: VehicleState) -> None:
        """Brake as long as the velocity can be counted on, then descend level: the position is lost."""
        self._begin(state, self._descend)
        self._blind_us = state.time_us + _COUNTED_ON_US

    def enter_offboard(self) -> None:
        """Follow the setpoints of `accept`."""
        self._step = self._follow_setpoint
        self.setpoint = self._offboard.setpoint

    def enter_sticks(self, state: VehicleState, mode: FlightMode) -> None:
        """Fly by hand."""
        steps: dict[FlightMode, Callable[[VehicleState], Command]] = {
            FlightMode.POSITION: self._sticks_position,
            FlightMode.ALTITUDE: self._sticks_altitude,
            FlightMode.ACRO: self._sticks_acro,
        }
        self._step = steps.get(mode, self._sticks_stabilized)
        self._stick_flight.start(state)
        self.setpoint = Setpoint(state.time_us)

    def enter_journey(
        self, state: VehicleState, target_ned_m: Vec3, yaw_rad: float = nan, speed_m_s: float = nan
    ) -> None:
        """Fly to a place and stay there.

        Args:
            state: the vehicle now.
            target_ned_m: shape (3,); a NaN component stays as it is, from where it has braked.
            yaw_rad: NaN: as MPC_YAW_MODE says.
            speed_m_s: horizontal; NaN: cruising speed.
        """
        traveller = self.traveller
        if self._step != self._travel:
            self._begin(state, self._travel)
        held = traveller.target_ned_m if traveller.is_at_rest else NAN3
        north_m, east_m, down_m = target_ned_m
        if isnan(north_m) or isnan(east_m):
            north_m, east_m = held[0], held[1]
        if isnan(down_m):
            down_m = held[2]
        traveller.go((north_m, east_m, down_m), yaw_rad, speed_m_s)
        self._show_journey(state)

    def departs(self, state: VehicleState) -> bool:
        """Whether it is on the way to a place well above it: then it leaves the ground even from hold."""
        if self._step == self._takeoff:
            return self._takeoff_ned_m[2] < state.position_ned_m[2] - _ABOVE_M
        return (
            self._step == self._travel and self.traveller.target_ned_m[2] < state.position_ned_m[2] - _ABOVE_M
        )

    @property
    def climb_ramp(self) -> ClimbRamp:
        """How the climb of a take-off grows in this mode."""
        if self._step in (self._takeoff, self._travel):
            return ClimbRamp(_RAMP_FROM_M_S, _CATCHING_UP * self.limits.auto_up_m_s)
        return ClimbRamp(_RAMP_FROM_M_S - _WOUND_UP_M_S, self.limits.up_m_s)

    def follow_leg(self, state: VehicleState, leg: Leg) -> None:
        """Fly a leg of a mission."""
        if leg.kind is LegKind.TAKEOFF:
            self.enter_takeoff(state, leg.target_ned_m[2])
        elif leg.kind is LegKind.LAND:
            self.enter_land(state, leg.target_ned_m[0], leg.target_ned_m[1])
        else:
            self.enter_journey(state, leg.target_ned_m, leg.yaw_rad, leg.speed_m_s)
            if leg.next_ned_m is not None:
                cruise_m_s = self.limits.cruise_m_s if isnan(leg.speed_m_s) else leg.speed_m_s
                self.traveller.pass_m_s = passing_speed(
                    state.position_ned_m, leg.target_ned_m, leg.next_ned_m, cruise_m_s
                )

    def enter_return(self, state: VehicleState, place_ned_m: Vec3 | None = None) -> None:
        """Climb, come home or to another place, shape (3,), land."""
        self._step = self._return
        self.returning.start(state, place_ned_m or self.home_ned_m, self._manners.returning, self.limits)
        self._show_journey(state)

    def enter_orbit(self, state: VehicleState, orbit: Orbit) -> None:
        """Circle around a point."""
        self._begin(state, self._circle)
        orbit.initial_yaw_rad = self.traveller.yaw_rad
        self._orbit = orbit
        self.setpoint = Setpoint(state.time_us, position_ned_m=orbit.centre_ned_m)

    def enter_follow(self, state: VehicleState) -> None:
        """Follow the target that reports itself; until it does, stay."""
        self._begin(state, self._follow_target)
        self.follower.start()
        self._show_journey(state)

    def accept(self, setpoint: Setpoint) -> None:
        """Take the next offboard setpoint; see `usable` and `bounded`."""
        self._offboard.accept(setpoint, self.limits)
        if self._step == self._follow_setpoint:
            self.setpoint = self._offboard.setpoint

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
        return _LITTLE * self._manners.sticks.hover_thrust - command.thrust

    def _begin(self, state: VehicleState, step: Callable[[VehicleState], Command]) -> None:
        """Another way to lead the point, from the velocity there is."""
        self._step = step
        self.traveller.start(state, self.limits)

    def _travel(self, state: VehicleState) -> Command:
        velocity_ned_m_s, yaw_rad = self.traveller.step(state, self.limits, self._period_s)
        if self.traveller.target_ned_m is not self._shown_ned_m:
            self._show_journey(state)
        return self._chase(state, velocity_ned_m_s, self._look(state, yaw_rad))

    def _takeoff(self, state: VehicleState) -> Command:
        target_ned_m = self._takeoff_ned_m
        north_m_s, east_m_s, down_m_s = towards(
            target_ned_m, state.position_ned_m, (0.0, 0.0, 0.0), self.limits
        )
        self.target_reached = abs(target_ned_m[2] - state.position_ned_m[2]) < _REACHED_M
        limits = self.limits
        self._climb_m_s = min(limits.takeoff_m_s, self._climb_m_s + limits.takeoff_m_s2 * self._period_s)
        down_m_s = max(down_m_s, -self._climb_m_s)
        return rate_command(state, (north_m_s, east_m_s, down_m_s), self._yaw_rad, self.limits)

    def _land(self, state: VehicleState) -> Command:
        traveller = self.traveller
        height_m = self.home_ned_m[2] - state.position_ned_m[2]
        traveller.drift_ned_m_s = (0.0, 0.0, self.limits.landing_m_s(height_m, self.limits.auto_down_m_s))
        velocity_ned_m_s, yaw_rad = traveller.step(state, self.limits, self._period_s, height_bound=False)
        return self._chase(state, velocity_ned_m_s, yaw_rad)

    def _descend(self, state: VehicleState) -> Command:
        if state.time_us < self._blind_us:
            return self._land(state)
        limits = self.limits
        turn_rad_s = yaw_rate(state.yaw_rad, self.traveller.yaw_rad, nan, limits)
        down_m_s = limits.landing_m_s(self.home_ned_m[2] - state.position_ned_m[2], limits.auto_down_m_s)
        return TiltCommand(0.0, 0.0, turn_rad_s, nan, down_m_s)

    def _return(self, state: VehicleState) -> Command:
        before = self.returning.phase
        phase = self.returning.advance(state)
        if phase is Phase.LAND:
            if before is not Phase.LAND:
                self.traveller.go((*self.traveller.target_ned_m[:2], nan), self.traveller.yaw_rad)
                self._show_journey(state)
            return self._land(state)
        if phase is not before:
            self._show_journey(state)
        return self._travel(state)

    def _circle(self, state: VehicleState) -> Command:
        orbit, limits = self._orbit, self.limits
        reference = self.traveller.led(state, limits)
        place = reference.position_ned_m
        north_m_s, east_m_s = orbit.velocity(place, limits.pace, limits.cruise_m_s)
        down_m_s = limits.pace.stopping_down(orbit.centre_ned_m[2] - place[2])
        down_m_s = clamp(down_m_s, -limits.auto_up_m_s, limits.auto_down_m_s)
        reference.move(state, (north_m_s, east_m_s, down_m_s), limits.pace, self._period_s)
        stick_rad_s = 0.0
        if orbit.yaw is OrbitYaw.STICKS:
            settings = self._manners.sticks
            stick_rad_s = self._stick_flight.released(self.sticks.yaw) * settings.yaw_rate_rad_s
        yaw_rad, turn_rad_s = orbit.look(state, stick_rad_s)
        velocity_ned_m_s = reference.chase(state, limits.position_gain, limits.height_gain)
        return self._chase(state, velocity_ned_m_s, yaw_rad, turn_rad_s)

    def _follow_target(self, state: VehicleState) -> Command:
        follower, traveller = self.follower, self.traveller
        if follower.is_lost(state.time_us):
            if not isnan(traveller.speed_m_s):
                traveller.start(state, self.limits)
            return self._travel(state)
        place, yaw_rad = follower.place(state, self._manners.following, self.home_ned_m[2])
        north_m_s, east_m_s, _ = follower.velocity_ned_m_s
        traveller.target_ned_m, traveller.yaw_rad = place, yaw_rad
        traveller.speed_m_s = self.limits.cruise_m_s
        traveller.drift_ned_m_s = (north_m_s, east_m_s, 0.0)
        velocity_ned_m_s, yaw_rad = traveller.step(state, self.limits, self._period_s)
        return self._chase(state, velocity_ned_m_s, yaw_rad)

    def _sticks_position(self, state: VehicleState) -> Command:
        return self._stick_flight.position(state, self.sticks, self.limits)

    def _sticks_altitude(self, state: VehicleState) -> Command:
        return self._stick_flight.altitude(state, self.sticks, self.limits)

    def _sticks_stabilized(self, _state: VehicleState) -> Command:
        return self._stick_flight.stabilized(self.sticks)

    def _sticks_acro(self, _state: VehicleState) -> Command:
        return self._stick_flight.acro(self.sticks)

    def _follow_setpoint(self, state: VehicleState) -> Command:
        return self._offboard.turning or self._offboard.step(state, self.limits)

    def _chase(
        self, state: VehicleState, velocity_ned_m_s: Vec3, yaw_rad: float, turn_rad_s: float = 0.0
    ) -> RateCommand:
        """Follow the point: limited velocity, its acceleration, and a turn that is not hasty."""
        limits = self.limits
        most_rad_s = limits.auto_yaw_rate_rad_s
        return RateCommand(
            level(state, limits.clip(*velocity_ned_m_s)),
            clamp(yaw_rate(state.yaw_rad, yaw_rad, turn_rad_s, limits), -most_rad_s, most_rad_s),
            level(state, self.traveller.reference.acceleration_ned_m_s2),
        )

    def _look(self, state: VehicleState, yaw_rad: float) -> float:
        """Towards the region of interest if there is one."""
        if self.region_ned_m is None:
            return yaw_rad
        north_m = self.region_ned_m[0] - state.position_ned_m[0]
        east_m = self.region_ned_m[1] - state.position_ned_m[1]
        return atan2(east_m, north_m) if hypot(north_m, east_m) > _FACING_M else yaw_rad

    def _show_journey(self, state: VehicleState) -> None:
        traveller = self.traveller
        self._shown_ned_m = traveller.target_ned_m
        self.setpoint = Setpoint(state.time_us, traveller.target_ned_m, yaw_rad=traveller.yaw_rad)
