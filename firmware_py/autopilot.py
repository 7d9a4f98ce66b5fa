"""The autopilot: the flight loop, and the commands of ground stations, apps and operators to it."""

from __future__ import annotations

from math import isinf, isnan, nan

from firmware_py.commander_table import BY_HAND, CommanderState, Event
from firmware_py.flight_loop import FlightLoop
from firmware_py.guidance.orbit import Orbit
from firmware_py.missions.flight import IssuedCommand
from firmware_py.status import CommandResult, FlightMode
from firmware_py.types import WARNING, ManualInput
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.geodesy import GeodeticPoint

_AUTO_BIT, _OFFBOARD_BIT = 1, 2  # of COM_RC_OVERRIDE


class Autopilot(FlightLoop):
    """The autopilot of one vehicle: `FlightLoop`, and a method for each command."""

    def arm(self, *, force: bool = False) -> CommandResult:
        """Arm, or report in a status text why not. As in PX4, a forced command skips no check."""
        self.prepare()
        return self._handle(Event.ARM)

    def disarm(self, *, force: bool = False) -> CommandResult:
        """Disarm: on the ground, or if forced also in the air."""
        return self._handle(Event.FORCE_DISARM if force else Event.DISARM)

    def terminate(self) -> CommandResult:
        """Stop the motors until disarmed, also in the air; always ACCEPTED."""
        return self._handle(FlightMode.TERMINATION)

    def set_mode(self, mode: FlightMode) -> CommandResult:
        """Change the mode; while armed only to one that can be flown, else a status text reports why not."""
        return self._handle(
            mode,
            takeoff_altitude_m=nan if mode is FlightMode.TAKEOFF else None,
            orbit=self.orbit_here() if mode is FlightMode.ORBIT else None,
        )

    def takeoff(self, altitude_amsl_m: float = nan) -> CommandResult:
        """Take off and hold; if disarmed, after arming.

        Args:
            altitude_amsl_m: metres above mean sea level; NaN: MIS_TAKEOFF_ALT above home. The vehicle does
                not descend to a lower one.

        Returns:
            ACCEPTED; DENIED for an infinite altitude.
        """
        if isinf(altitude_amsl_m):
            self.say(WARNING, "Takeoff denied: altitude is infinite")
            return CommandResult.DENIED
        return self._handle(FlightMode.TAKEOFF, takeoff_altitude_m=altitude_amsl_m)

    def land(self) -> CommandResult:
        """Land here; always ACCEPTED."""
        return self._handle(FlightMode.LAND)

    def reposition(self, target_ned_m: Vec3, yaw_rad: float = nan, speed_m_s: float = nan) -> CommandResult:
        """Fly to a place and hold there.

        Args:
            target_ned_m: in the local frame, shape (3,); in NaN components the vehicle brakes and stays.
            yaw_rad: NaN: by MPC_YAW_MODE.
            speed_m_s: horizontal; NaN: MPC_XY_CRUISE.

        Returns:
            ACCEPTED, TEMPORARILY_REJECTED when hold cannot be entered, DENIED outside the fence.
        """
        breach = self._navigator.breach_at(target_ned_m) if not any(map(isnan, target_ned_m)) else None
        if breach is not None:
            self.say(WARNING, f"Reposition denied: {breach}")
            return CommandResult.DENIED
        result = self._handle(FlightMode.HOLD)
        stays_on_ground = self._land_detector.landed and all(map(isnan, target_ned_m))
        if result is CommandResult.ACCEPTED and self.status.armed and not stays_on_ground:
            self._guidance.fly_to(self.state, target_ned_m, yaw_rad, speed_m_s)
        return result

    def orbit(self, orbit: Orbit) -> CommandResult:
        """Fly an orbit, if that is possible now."""
        return self._handle(FlightMode.ORBIT, orbit=orbit)

    def orbit_here(self) -> Orbit:
        """The default orbit, PX4's: a radius of 1 m around the present position."""
        return Orbit(self.state.position_ned_m)

    def change_speed(self, speed_m_s: float) -> CommandResult:
        """Fly to the present target at another horizontal speed; NaN: MPC_XY_CRUISE."""
        self._guidance.context.trajectory.speed_m_s = speed_m_s
        return CommandResult.ACCEPTED

    def look_at(self, point_ned_m: Vec3 | None) -> CommandResult:
        """Turn to a place, shape (3,), while flying to targets and in hold; None: no longer."""
        self._guidance.context.region_ned_m = point_ned_m
        return CommandResult.ACCEPTED

    def set_home(self, point: GeodeticPoint | None) -> CommandResult:
        """Set home to a place on Earth; None: to the present position."""
        geo = self._geo
        if geo.projection is None:
            self.say(WARNING, "Set home denied: no position estimate")
            return CommandResult.TEMPORARILY_REJECTED
        if point is None:
            geo.set_home_at(self.state.position_ned_m)
        elif not geo.set_home(point):
            self.say(WARNING, "Set home denied: not a place on Earth")
            return CommandResult.DENIED
        self._publish_places()
        return CommandResult.ACCEPTED

    def set_origin(self, point: GeodeticPoint) -> CommandResult:
        """Set where on Earth the local frame's origin is."""
        if not self._geo.move_origin(point):
            return CommandResult.DENIED
        self._publish_places()
        return CommandResult.ACCEPTED

    def manual_input(self, sticks: ManualInput) -> None:
        """Take manual control input; in automatic modes, moved sticks take over (COM_RC_OVERRIDE)."""
        self._guidance.context.sticks = sticks
        self._commander.note_manual_input()
        state = self._commander.state
        if self._motors_stopped or state in BY_HAND or self._land_detector.landed:
            return
        threshold = self.parameters.value("COM_RC_STICK_OV") / 100.0
        bit = _OFFBOARD_BIT if state is CommanderState.OFFBOARD else _AUTO_BIT
        moved = max(abs(sticks.forward), abs(sticks.right), abs(sticks.yaw)) > threshold
        if moved and self.parameters.integer("COM_RC_OVERRIDE") & bit:
            self._handle(Event.STICKS_TAKE_OVER)

    def ground_station_heard(self) -> None:
        """Note a ground station's heartbeat."""
        self._commander.note_ground_station()

    def follow_target(self, position_ned_m: Vec3, velocity_ned_m_s: Vec3) -> None:
        """Take a report of the target to follow, in the local frame."""
        self._guidance.follow.follower.report(self._now_us, position_ned_m, velocity_ned_m_s)

    def global_position(self) -> GeodeticPoint | None:
        """The estimated position on Earth; None before the first usable sample."""
        return self._geo.to_geodetic(self.state.position_ned_m)

    def local_position(self, point: GeodeticPoint) -> Vec3 | None:
        """A place on Earth in the local frame, NED metres; None before the origin is known."""
        return self._geo.to_local(point)

    def check_mission(self) -> None:
        """Check whether the mission can be flown, if it, the fence or home has changed, and say why not."""
        landed = self._land_detector.landed
        self._texts.extend(self._navigator.check_mission(self.state, self._geo, landed=landed))

    def take_issued_commands(self) -> list[IssuedCommand]:
        """The mission's commands to others, such as the camera, since the last call."""
        return self._navigator.take_issued()
