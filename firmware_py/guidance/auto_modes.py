"""Modes that fly by themselves: hold and journeys, take-off, landing, descent without a position, orbit."""

from __future__ import annotations

from dataclasses import replace
from math import isnan, nan

from firmware_py.airframe import Airframe
from firmware_py.commands import ControlCommand, TiltCommand
from firmware_py.guidance.limits import clamp, velocity_command, velocity_towards, yaw_rate
from firmware_py.guidance.mode import JourneyMode, Mode, ModeEntry
from firmware_py.guidance.orbit import OrbitYaw
from firmware_py.guidance.sticks import stick_settings
from firmware_py.guidance.travel import passing_speed
from firmware_py.missions.flight import Leg
from firmware_py.parameters import Parameters
from firmware_py.setpoints import TrajectorySetpoint
from firmware_py.types import VehicleState
from geometry.vectors import NAN3, ZERO3, Vec3

_REACHED_M = 0.15
_ABOVE_M = 0.5  # a place so much higher is flown to from the ground
_VELOCITY_VALID_US = 5_000_000  # without a position, the velocity is good enough to brake by for this long


class HoldMode(JourneyMode):
    """Brakes and holds place and yaw, or flies to a place and holds there."""

    takes_off = True

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Brake, or go on to the present target (after a take-off or a mission)."""
        if not entry.keep_target or entry.previous is not self:
            self._begin(state)
            target = entry.previous.hold_target if entry.keep_target else None
            if target is not None:
                self._context.traveller.go(*target)
        self._show_journey(state)

    def step(self, state: VehicleState) -> ControlCommand:
        """Go on to the target."""
        return self._travel(state)

    def go_to(
        self, state: VehicleState, target_ned_m: Vec3, yaw_rad: float, speed_m_s: float, *, begins: bool
    ) -> None:
        """Fly to a place and stay there.

        Args:
            state: the vehicle now.
            target_ned_m: shape (3,); a NaN component stays as it is, from where it has braked.
            yaw_rad: NaN: as MPC_YAW_MODE says.
            speed_m_s: horizontal; NaN: cruising speed.
            begins: another mode was flown until now.
        """
        traveller = self._context.traveller
        if begins:
            self._begin(state)
        held = traveller.target_ned_m if traveller.is_at_rest else NAN3
        north_m, east_m, down_m = target_ned_m
        if isnan(north_m) or isnan(east_m):
            north_m, east_m = held[0], held[1]
        if isnan(down_m):
            down_m = held[2]
        traveller.go((north_m, east_m, down_m), yaw_rad, speed_m_s)
        self._show_journey(state)

    def fly_leg(self, state: VehicleState, leg: Leg, *, begins: bool) -> None:
        """Fly to a leg's place, and past it if there is a next one."""
        self.go_to(state, leg.target_ned_m, leg.yaw_rad, leg.speed_m_s, begins=begins)
        if leg.next_ned_m is not None:
            cruise_m_s = self._context.limits.cruise_m_s if isnan(leg.speed_m_s) else leg.speed_m_s
            self._context.traveller.pass_m_s = passing_speed(
                state.position_ned_m, leg.target_ned_m, leg.next_ned_m, cruise_m_s
            )

    def departs(self, state: VehicleState) -> bool:
        """Whether the target is well above."""
        return self._context.traveller.target_ned_m[2] < state.position_ned_m[2] - _ABOVE_M


class TakeoffMode(Mode):
    """Climbs straight up to a height; one below the present height means to stay."""

    takes_off = True

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
        """The place climbed to, and the yaw."""
        return self._target_ned_m, self._yaw_rad


class LandMode(JourneyMode):
    """Descends to the ground, at a place or where it stops."""

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Land at the entry's target; NaN: where it stops."""
        self._begin(state)
        traveller = self._context.traveller
        traveller.go((entry.target_ned_m[0], entry.target_ned_m[1], nan), traveller.yaw_rad)
        self._show_journey(state)

    def step(self, state: VehicleState) -> ControlCommand:
        """Descend."""
        return self._sink(state)


class DescendMode(JourneyMode):
    """Descends when the position is lost: brakes as long as the velocity is valid, then sinks level."""

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Begin here; telemetry goes on to tell the last setpoint."""
        self._begin(state)
        self._level_from_us = state.time_us + _VELOCITY_VALID_US
        self.setpoint = entry.previous.setpoint

    def step(self, state: VehicleState) -> ControlCommand:
        """Descend."""
        if state.time_us < self._level_from_us:
            return self._sink(state)
        context = self._context
        limits = context.limits
        turn_rad_s = yaw_rate(state.yaw_rad, context.traveller.yaw_rad, nan, limits)
        height_m = context.home_ned_m[2] - state.position_ned_m[2]
        return TiltCommand(0.0, 0.0, turn_rad_s, limits.landing_m_s(height_m, limits.auto_down_m_s))


class OrbitMode(JourneyMode):
    """Circles around a point."""

    def configure(self, airframe: Airframe, parameters: Parameters) -> None:
        """Take over what full sticks mean."""
        self._sticks = stick_settings(airframe, parameters)

    def enter(self, state: VehicleState, entry: ModeEntry) -> None:
        """Circle as the entry says."""
        self._begin(state)
        self._orbit = replace(entry.orbit, initial_yaw_rad=self._context.traveller.yaw_rad)
        self.setpoint = TrajectorySetpoint(state.time_us, entry.orbit.centre_ned_m)

    def step(self, state: VehicleState) -> ControlCommand:
        """Lead the point to the circle and along it."""
        context, orbit = self._context, self._orbit
        limits = context.limits
        reference = context.traveller.led(state, limits)
        place = reference.position_ned_m
        north_m_s, east_m_s = orbit.velocity(place, limits.pace, limits.cruise_m_s)
        down_m_s = limits.pace.stopping_down(orbit.centre_ned_m[2] - place[2])
        down_m_s = clamp(down_m_s, -limits.auto_up_m_s, limits.auto_down_m_s)
        reference.move(state, (north_m_s, east_m_s, down_m_s), limits.pace, context.period_s)
        stick_rad_s = 0.0
        if orbit.yaw is OrbitYaw.STICKS:
            stick_rad_s = self._sticks.released(context.sticks.yaw) * self._sticks.yaw_rate_rad_s
        yaw_rad, turn_rad_s = orbit.look(state, stick_rad_s)
        velocity_ned_m_s = reference.chase(state, limits.position_gain, limits.height_gain)
        return self._chase(state, velocity_ned_m_s, yaw_rad, turn_rad_s)
