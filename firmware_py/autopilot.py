"""The autopilot as ground stations, apps and pilots see it: the flight loop, and commands to it."""

from __future__ import annotations

from math import isinf, isnan, nan

from firmware_py.commander_table import BY_HAND, MODE_EVENT, Event, State
from firmware_py.flight_loop import FlightLoop
from firmware_py.guidance.orbit import Orbit
from firmware_py.missions.flight import IssuedCommand
from firmware_py.setpoints import Setpoint
from firmware_py.status import CommandResult, FlightMode
from firmware_py.types import WARNING, GeodeticPoint, ManualInput
from geometry.vectors import Vec3

_AUTO_BIT, _OFFBOARD_BIT = 1, 2  # of COM_RC_OVERRIDE


class Autopilot(FlightLoop):
    """A whole autopilot for one vehicle: `FlightLoop`, and a method for each thing asked of it."""

    def arm(self, *, force: bool = False) -> CommandResult:
        """Arm, or say in a status text why not. As in PX4, forcing from outside skips no check."""
        del force
        self.prepare()
        return self._handle(Event.ARM)

    def disarm(self, *, force: bool = False) -> CommandResult:
        """Disarm: on the ground, or anywhere at once if forced."""
        return self._handle(Event.FORCE_DISARM if force else Event.DISARM)

    def terminate(self) -> CommandResult:
        """Stop the motors for good, wherever it is; always ACCEPTED."""
        return self._handle(Event.TERMINATE)

    def set_mode(self, mode: FlightMode) -> CommandResult:
        """Change the mode: disarmed always; armed, to one that can be flown; else a text says why."""
        return self._handle(
            MODE_EVENT[mode],
            takeoff_altitude_m=nan if mode is FlightMode.TAKEOFF else None,
            orbit=self.orbit_here() if mode is FlightMode.ORBIT else None,
        )

    def takeoff(self, altitude_amsl_m: float = nan) -> CommandResult:
        """Take off and hold; if disarmed, as soon as it is armed.

        Args:
            altitude_amsl_m: metres above mean sea level; NaN: MIS_TAKEOFF_ALT above home. One below the
                vehicle means to stay at its height.

        Returns:
            ACCEPTED; DENIED for an infinite altitude.
        """
        if isinf(altitude_amsl_m):
            self.say(WARNING, "Takeoff denied: altitude is infinite")
            return CommandResult.DENIED
        return self._handle(Event.SET_TAKEOFF, takeoff_altitude_m=altitude_amsl_m)

    def land(self) -> CommandResult:
        """Land where it is; always ACCEPTED."""
        return self._handle(Event.SET_LAND)

    def reposition(self, target_ned_m: Vec3, yaw_rad: float = nan, speed_m_s: float = nan) -> CommandResult:
        """Fly to a place and hold there.

        Args:
            target_ned_m: in the local frame, shape (3,); NaN components: where it holds, or has braked.
            yaw_rad: where to look; NaN: along the way.
            speed_m_s: horizontal; NaN: MPC_XY_CRUISE.

        Returns:
            ACCEPTED, TEMPORARILY_REJECTED when hold cannot be entered, DENIED outside the fence.
        """
        breach = self._navigator.breach_at(target_ned_m) if not any(map(isnan, target_ned_m)) else None
        if breach is not None:
            self.say(WARNING, f"Reposition denied: {breach}")
            return CommandResult.DENIED
        result = self._handle(Event.SET_HOLD)
        nowhere = self._land_detector.landed and all(map(isnan, target_ned_m))
        if result is CommandResult.ACCEPTED and self.status.armed and not nowhere:
            self._guidance.fly_to(self.state, target_ned_m, yaw_rad, speed_m_s)  # also from the ground
        return result

    def orbit(self, orbit: Orbit) -> CommandResult:
        """Circle around a point, if that can be flown now."""
        return self._handle(Event.SET_ORBIT, orbit=orbit)

    def orbit_here(self) -> Orbit:
        """The circle that is flown when no other was asked for: PX4's, 1 m around where it is."""
        return Orbit(self.state.position_ned_m)

    def change_speed(self, speed_m_s: float) -> CommandResult:
        """Fly the present journey at another horizontal speed; NaN: MPC_XY_CRUISE again."""
        self._guidance.change_speed(speed_m_s)
        return CommandResult.ACCEPTED

    def look_at(self, point_ned_m: Vec3 | None) -> CommandResult:
        """On journeys and in hold, turn the nose to a place, shape (3,); None: no more."""
        self._guidance.look_at(point_ned_m)
        return CommandResult.ACCEPTED

    def set_home(self, point: GeodeticPoint | None) -> CommandResult:
        """Set home to a place on Earth, or (None) to where the vehicle is."""
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
        """Say where on Earth the local frame's origin is."""
        if not self._geo.move_origin(point):
            return CommandResult.DENIED
        self._publish_places()
        return CommandResult.ACCEPTED

    def accept_setpoint(self, setpoint: Setpoint) -> None:
        """Take an offboard setpoint; it is flown in OFFBOARD and lets OFFBOARD be entered.

        One that says nothing that can be flown counts as none received; a status text says so, once until a
        usable one comes.
        """
        if setpoint.is_usable:
            self.setpoints.put(setpoint, self._now_us)
            self._commander.setpoint_came(setpoint.time_us)
        elif self.setpoints.refuse():
            self.say(WARNING, "Offboard setpoint ignored: nothing in it can be flown")

    def manual_input(self, sticks: ManualInput) -> None:
        """Take a pilot's sticks; moved in a mode that flies itself, they take over (COM_RC_OVERRIDE)."""
        self._guidance.take_sticks(sticks)
        self._commander.sticks_came()
        state = self._commander.state
        if self._motors_stopped or state in BY_HAND or self._land_detector.landed:
            return
        threshold = self.parameters.value("COM_RC_STICK_OV") / 100.0
        bit = _OFFBOARD_BIT if state is State.OFFBOARD else _AUTO_BIT
        moved = max(abs(sticks.forward), abs(sticks.right), abs(sticks.yaw)) > threshold
        if moved and self.parameters.integer("COM_RC_OVERRIDE") & bit:
            self._handle(Event.PILOT_TAKES_OVER)

    def ground_station_heard(self) -> None:
        """Note a ground station's heartbeat."""
        self._commander.ground_station_heard()

    def follow_target(self, position_ned_m: Vec3, velocity_ned_m_s: Vec3) -> None:
        """Take a report of the target to follow, in the local frame."""
        self._guidance.report_target(self._now_us, position_ned_m, velocity_ned_m_s)

    def global_position(self) -> GeodeticPoint | None:
        """Where on Earth it believes to be; None before the first usable sample."""
        return self._geo.to_geodetic(self.state.position_ned_m)

    def local_position(self, point: GeodeticPoint) -> Vec3 | None:
        """A place on Earth in the local frame, NED metres; None before the origin is known."""
        return self._geo.to_local(point)

    def take_issued_commands(self) -> list[IssuedCommand]:
        """What the mission commands others, such as the camera, since the last call."""
        return self._navigator.take_issued()
