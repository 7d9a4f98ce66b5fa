"""Automatic modes: hold and goto, take-off, landing, descent without a position, orbit, return."""

from __future__ import annotations

from dataclasses import replace
from enum import Enum
from math import hypot, isnan, nan, radians, tan

from firmware_py.commands import ControlCommand, TiltCommand
from firmware_py.guidance.limits import clamp, velocity_command, velocity_towards, yaw_rate
from firmware_py.guidance.mode import Mode, ModeEntry, TrajectoryMode
from firmware_py.guidance.orbit import OrbitYaw
from firmware_py.guidance.sticks import StickSettings
from firmware_py.guidance.trajectory import passing_speed
from firmware_py.missions.flight import MissionLeg
from firmware_py.parameters import Parameters
from firmware_py.setpoints import TrajectorySetpoint
from firmware_py.types import VehicleState
from framerunner.geometry.vectors import NAN3, ZERO3, Vec3
from framerunner.vehicle.airframe import Airframe

_REACHED_M = 0.15
_ABOVE_M = 0.5  # the vehicle leaves the ground for a target so much higher
_VELOCITY_VALID_US = 5_000_000  # without a position, the velocity can be used for braking this long
_MAX_CONE_DEG = 89.0
_AT_HOME_M = 0.5  # a landing descends vertically, so it begins over the place


class HoldMode(TrajectoryMode):
    """Brakes and holds position and yaw, or flies to a place and holds there."""

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Brake, or continue to the present target (after a take-off or a mission)."""
        if not entry.keep_target or entry.previous is not self:
            self._start(state)
            target = entry.previous.hold_target if entry.keep_target else None
            if target is not None:
                self._context.trajectory.go(*target)
        self._show_target(state)

    def step(self, state: VehicleState) -> ControlCommand:
        """Fly to the target and hold there."""
        return self._fly_to_target(state)

    def go_to(
        self, state: VehicleState, target_ned_m: Vec3, yaw_rad: float, speed_m_s: float, *, begins: bool
    ) -> None:
        """Fly to a place and stay there.

        Args:
            state: of the vehicle now.
            target_ned_m: shape (3,); in a NaN component the vehicle stays, once it has braked.
            yaw_rad: NaN: by MPC_YAW_MODE.
            speed_m_s: horizontal; NaN: cruising speed.
            begins: another mode was flown until now.
        """
        trajectory = self._context.trajectory
        if begins:
            self._start(state)
        held = trajectory.target_ned_m if trajectory.is_at_rest else NAN3
        north_m, east_m, down_m = target_ned_m
        if isnan(north_m) or isnan(east_m):
            north_m, east_m = held[0], held[1]
        if isnan(down_m):
            down_m = held[2]
        trajectory.go((north_m, east_m, down_m), yaw_rad, speed_m_s)
        self._show_target(state)

    def fly_leg(self, state: VehicleState, leg: MissionLeg, *, begins: bool) -> None:
        """Fly to a leg's target, and past it if there is a next one."""
        self.go_to(state, leg.target_ned_m, leg.yaw_rad, leg.speed_m_s, begins=begins)
        if leg.next_ned_m is not None:
            cruise_m_s = self._context.limits.cruise_m_s if isnan(leg.speed_m_s) else leg.speed_m_s
            self._context.trajectory.pass_m_s = passing_speed(
                state.position_ned_m, leg.target_ned_m, leg.next_ned_m, cruise_m_s
            )

    def departs(self, state: VehicleState) -> bool:
        """Whether the target is well above."""
        return self._context.trajectory.target_ned_m[2] < state.position_ned_m[2] - _ABOVE_M


class TakeoffMode(Mode):
    """Climbs vertically to a height; it does not descend to a lower one."""

    builds_up_climb = True

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Climb to the height of the entry's target, from here."""
        north_m, east_m, down_m = state.position_ned_m
        self._target_ned_m = (north_m, east_m, min(down_m, entry.target_ned_m[2]))
        self._yaw_rad = state.yaw_rad
        self._climb_m_s = max(0.0, -state.velocity_ned_m_s[2])
        self.target_reached = False
        self.setpoint = TrajectorySetpoint(state.time_us, self._target_ned_m, yaw_rad=self._yaw_rad)

    def step(self, state: VehicleState) -> ControlCommand:
        """Climb; the climb is built up over MPC_TKO_RAMP_T."""
        context, target_ned_m = self._context, self._target_ned_m
        limits = context.limits
        north_m_s, east_m_s, down_m_s = velocity_towards(target_ned_m, state.position_ned_m, ZERO3, limits)
        self.target_reached = abs(target_ned_m[2] - state.position_ned_m[2]) < _REACHED_M
        self._climb_m_s = min(limits.takeoff_m_s, self._climb_m_s + limits.takeoff_m_s2 * context.period_s)
        down_m_s = max(down_m_s, -self._climb_m_s)
        return velocity_command(state, (north_m_s, east_m_s, down_m_s), self._yaw_rad, limits)

    def departs(self, state: VehicleState) -> bool:
        """Whether the target is well above."""
        return self._target_ned_m[2] < state.position_ned_m[2] - _ABOVE_M

    @property
    def hold_target(self) -> tuple[Vec3, float] | None:
        """The target and the yaw."""
        return self._target_ned_m, self._yaw_rad


class LandMode(TrajectoryMode):
    """Lands at a place, or where the vehicle stops."""

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Land at the entry's target; NaN: where the vehicle stops."""
        self._start(state)
        trajectory = self._context.trajectory
        trajectory.go((entry.target_ned_m[0], entry.target_ned_m[1], nan), trajectory.yaw_rad)
        self._show_target(state)

    def step(self, state: VehicleState) -> ControlCommand:
        """Descend."""
        return self._descend(state)


class DescendMode(TrajectoryMode):
    """Descends after the position is lost: brakes while the velocity is valid, then keeps level."""

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Begin here; telemetry keeps the last setpoint."""
        self._start(state)
        self._level_from_us = state.time_us + _VELOCITY_VALID_US
        self.setpoint = entry.previous.setpoint

    def step(self, state: VehicleState) -> ControlCommand:
        """Descend."""
        if state.time_us < self._level_from_us:
            return self._descend(state)
        context = self._context
        limits = context.limits
        turn_rad_s = yaw_rate(state.yaw_rad, context.trajectory.yaw_rad, nan, limits)
        height_m = context.home_ned_m[2] - state.position_ned_m[2]
        return TiltCommand(0.0, 0.0, turn_rad_s, limits.landing_m_s(height_m, limits.auto_down_m_s))


class OrbitMode(TrajectoryMode):
    """Circles around a point."""

    def configure(self, airframe: Airframe, parameters: Parameters) -> None:
        """Apply the meaning of full sticks."""
        self._sticks = StickSettings(airframe, parameters)

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Fly the entry's orbit."""
        self._start(state)
        self._orbit = replace(entry.orbit, initial_yaw_rad=self._context.trajectory.yaw_rad)
        self.setpoint = TrajectorySetpoint(state.time_us, entry.orbit.centre_ned_m)

    def step(self, state: VehicleState) -> ControlCommand:
        """Move the reference point to the circle and along it."""
        context, orbit = self._context, self._orbit
        limits = context.limits
        reference = context.trajectory.started(state, limits)
        place = reference.position_ned_m
        north_m_s, east_m_s = orbit.velocity(place, limits.acceleration, limits.cruise_m_s)
        down_m_s = limits.acceleration.stopping_down(orbit.centre_ned_m[2] - place[2])
        down_m_s = clamp(down_m_s, -limits.auto_up_m_s, limits.auto_down_m_s)
        reference.move(state, (north_m_s, east_m_s, down_m_s), limits.acceleration, context.period_s)
        stick_rad_s = 0.0
        if orbit.yaw is OrbitYaw.STICKS:
            stick_rad_s = self._sticks.without_dead_zone(context.sticks.yaw) * self._sticks.yaw_rate_rad_s
        yaw_rad, turn_rad_s = orbit.look(state, stick_rad_s)
        velocity_ned_m_s = reference.tracking_velocity(state, limits.position_gain, limits.height_gain)
        return self._follow(state, velocity_ned_m_s, yaw_rad, turn_rad_s)


class ReturnSettings:
    """The RTL_ and NAV_ parameters.

    Heights above home and distances in metres; the delay in microseconds, negative: no landing.
    """

    def __init__(self, parameters: Parameters) -> None:
        value = parameters.value
        self.return_altitude_m = value("RTL_RETURN_ALT")
        self.descend_altitude_m = value("RTL_DESCEND_ALT")
        self.cone_deg = value("RTL_CONE_ANG")
        self.near_m = value("RTL_MIN_DIST")
        self.acceptance_m = value("NAV_ACC_RAD")
        self.height_acceptance_m = value("NAV_MC_ALT_RAD")
        self.delay_us = round(value("RTL_LAND_DELAY") * 1e6)


def return_height_m(settings: ReturnSettings, distance_m: float, height_m: float) -> float:
    """Height above home at which to return, by PX4 1.17's rule.

    Far away it is RTL_RETURN_ALT; near home a cone limits the climb. The vehicle never descends for the
    return, and without a cone it always climbs.

    Args:
        settings: of the parameters.
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
    """Phase of a return."""

    CLIMB = "climb"
    FLY = "fly"
    DESCEND = "descend"
    WAIT = "wait"
    LAND = "land"


class ReturnMode(TrajectoryMode):
    """Climbs, returns to a place, descends and lands there."""

    def configure(self, airframe: Airframe, parameters: Parameters) -> None:
        """Apply heights and distances to the next return."""
        self._configured = ReturnSettings(parameters)

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Return to the entry's target."""
        context, settings = self._context, self._configured
        self._settings, self._place_ned_m = settings, entry.target_ned_m
        self._phase, self._wait_since_us = Phase.CLIMB, 0
        place = entry.target_ned_m
        north_m, east_m, down_m = state.position_ned_m
        distance_m = hypot(place[0] - north_m, place[1] - east_m)
        height_m = return_height_m(settings, distance_m, place[2] - down_m)
        self._start(state)
        context.trajectory.go((nan, nan, place[2] - height_m), context.trajectory.yaw_rad)
        self._show_target(state)

    def step(self, state: VehicleState) -> ControlCommand:
        """Start the next phase when this one is done, and fly it."""
        before = self._phase
        self._advance(state)
        if self._phase is not Phase.LAND:
            if self._phase is not before:
                self._show_target(state)
            return self._fly_to_target(state)
        if before is not Phase.LAND:
            trajectory = self._context.trajectory
            trajectory.go((*trajectory.target_ned_m[:2], nan), trajectory.yaw_rad)
            self._show_target(state)
        return self._descend(state)

    def _advance(self, state: VehicleState) -> None:
        settings, trajectory, place = self._settings, self._context.trajectory, self._place_ned_m
        if self._phase is Phase.LAND:
            return
        if self._phase is Phase.CLIMB and trajectory.climb_m(state) < settings.height_acceptance_m:
            self._phase = Phase.FLY
            trajectory.go((place[0], place[1], trajectory.target_ned_m[2]))
        if self._phase is Phase.FLY and trajectory.distance_m(state) < _AT_HOME_M:
            self._phase = Phase.DESCEND
            lowest_m = min(settings.descend_altitude_m, place[2] - state.position_ned_m[2])
            trajectory.go((place[0], place[1], place[2] - lowest_m), state.yaw_rad)
        if self._phase is Phase.DESCEND and abs(trajectory.climb_m(state)) < settings.height_acceptance_m:
            self._phase = Phase.WAIT
            self._wait_since_us = state.time_us
        waits = settings.delay_us < 0 or state.time_us - self._wait_since_us < settings.delay_us
        if self._phase is Phase.WAIT and not waits:
            self._phase = Phase.LAND
