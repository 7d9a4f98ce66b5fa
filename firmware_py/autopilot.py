"""The autopilot: sensors in, motor speeds out. Joins estimator, commander, guidance and stabiliser.

It reads no clock and opens nothing: time is what the sensors say, and who calls it decides how fast.
"""

from __future__ import annotations

from collections import deque
from math import cos, isinf, isnan, nan, radians

from firmware_py.airframe import Airframe
from firmware_py.commander import Commander
from firmware_py.commander_table import INFO, MODE_EVENT, WARNING, Event, Row, State
from firmware_py.estimator import Estimator
from firmware_py.guidance.circles import Orbit
from firmware_py.guidance.limits import speed_limits
from firmware_py.guidance.modes import Guidance, manners
from firmware_py.land_detector import LandDetector
from firmware_py.lift_off import LiftOff, RateStabiliser, Undesigned, goes_straight_through
from firmware_py.missions.flight import IssuedCommand
from firmware_py.missions.store import MissionStore
from firmware_py.mode_entry import ModeEntry
from firmware_py.navigator import Navigator
from firmware_py.offboard_intake import OffboardIntake
from firmware_py.parameters import Parameters
from firmware_py.places import Places
from firmware_py.status import CommandResult, FlightMode, LandedState, VehicleStatus
from firmware_py.types import (
    BatteryState,
    Command,
    FlightRecord,
    GeodeticPoint,
    ManualInput,
    MotorOutput,
    MotorSpeeds,
    Sensors,
    Setpoint,
    StatusText,
)
from firmware_py.watch import Watch
from geometry.vectors import Vec3

_TEXTS_KEPT = 100
_READY_PERIOD_US = 100_000  # once armed, whether it could be armed again is of little interest

_GROUND_STATES = frozenset(
    {
        State.HOLD,
        State.FAILSAFE_HOLD,
        State.LAND,
        State.FAILSAFE_LAND,
        State.FAILSAFE_DESCEND,
        State.RETURN,
        State.FAILSAFE_RETURN,
    }
)
_AIRBORNE_STATES = {
    State.TAKEOFF: LandedState.TAKEOFF,
    State.LAND: LandedState.LANDING,
    State.FAILSAFE_LAND: LandedState.LANDING,
    State.FAILSAFE_DESCEND: LandedState.LANDING,
}
_STOPPED_STATES = frozenset({State.DISARMED, State.TERMINATED})
_BY_HAND = frozenset({State.MANUAL, State.STABILIZED, State.ACRO, State.ALTITUDE, State.POSITION})
_AUTO_BIT, _OFFBOARD_BIT = 1, 2  # of COM_RC_OVERRIDE


class Autopilot:
    """A whole autopilot for one vehicle.

    Args:
        airframe: what it flies.
        origin: where on Earth the sensors' positions count from.
        parameters: shared with the MAVLink services; the airframe's defaults if not given.
        control_period_s: time between calls of `step`.
        stabiliser: another one than the airframe's own design, for tests.

    Attributes:
        airframe: what it flies.
        parameters: what a ground station may change; changes act at the next tick.
        estimator: knows the local frame's origin.
        state: the estimate of the vehicle, updated in place.
        status: arming, mode, home and so on, updated in place.
        output: what the last step sent to the motors.
        battery: what is known of the battery.
        flight: times of the flight now or last.
        missions: mission, fence and rally points.
    """

    def __init__(
        self,
        airframe: Airframe,
        origin: GeodeticPoint,
        parameters: Parameters | None = None,
        control_period_s: float = 0.004,
        *,
        stabiliser: RateStabiliser | None = None,
    ) -> None:
        """Boot, disarmed; see the class for the arguments."""
        self.airframe = airframe
        self.parameters = parameters if parameters is not None else Parameters(defaults=airframe.parameters)
        self.status = VehicleStatus()
        self.flight = FlightRecord()
        self.missions = MissionStore()
        self.estimator = Estimator()
        self.state = self.estimator.state
        self._places = Places(self.status, origin)
        self._period_us = round(control_period_s * 1e6)
        self._now_us = 0
        self._commander = Commander()
        self._guidance = Guidance(
            speed_limits(airframe, self.parameters), manners(airframe, self.parameters), control_period_s
        )
        self._stabiliser: RateStabiliser = Undesigned() if stabiliser is None else stabiliser
        self._lift_off = LiftOff()
        self._navigator = Navigator(self.missions, self.parameters)
        self._watch = Watch(
            self._navigator,
            self._commander.situation,
            self.say,
            airframe=airframe,
            parameters=self.parameters,
        )
        self.battery: BatteryState = self._watch.battery.state
        self._entry = ModeEntry(
            self.state,
            self.status,
            places=self._places,
            guidance=self._guidance,
            navigator=self._navigator,
            parameters=self.parameters,
            say=self.say,
        )
        self._land_detector = LandDetector((airframe.hover_speed_rad_s / airframe.motor.max_speed_rad_s) ** 2)
        self._stopped = MotorOutput((0.0,) * len(airframe.rotors))
        self.output = self._stopped
        self._state_entered = State.DISARMED
        self._motors_stand = True
        self._shown_state: State | None = None
        self._airborne = LandedState.IN_AIR
        self._texts: deque[StatusText] = deque(maxlen=_TEXTS_KEPT)
        self.intake = OffboardIntake(self._guidance, self.say)
        self._ready_due_us = 0
        self._parameters_version = -1
        self._upright_cosine = 0.0
        self._configure()

    def prepare(self) -> None:
        """Design the stabiliser, if that has not been done; arming does it at the latest.

        It takes some tenths of a second, most of them to import SciPy, so a program in real time does it
        before its clock runs, and after it has sent its first heartbeat.
        """
        if isinstance(self._stabiliser, Undesigned):
            from firmware_py.control.stabiliser import Stabiliser

            self._stabiliser = Stabiliser(self.airframe, self._period_us / 1e6)
            self._parameters_version = -1  # it is told of its limits with the next tick

    def step(self, sensors: Sensors) -> MotorSpeeds:
        """Fly one control tick.

        Args:
            sensors: this tick's sample. An unusable one (not finite, not newer than the last) is bridged
                with the last motor speeds; soon after, the commander gives up.

        Returns:
            Rotor speeds in rad/s, in the airframe's order; zeros while disarmed.
        """
        if self.parameters.version != self._parameters_version:
            self._configure()
        state, commander, guidance = self.state, self._commander, self._guidance
        sound = self.estimator.update(sensors)
        if sound:
            self._now_us = max(self._now_us, state.time_us)
            if self._places.projection is None:
                self._fix_origin()
            self._detect_land()
        else:
            self._now_us += self._period_us
        if self._now_us >= self._watch.due_us:
            self._update_view()
            self._watch.look(self._now_us, sensors, armed=self.status.armed)
        if self.intake.waiting is not None:
            self.intake.pass_on(self._now_us)
        _, x, y, _ = state.attitude
        row = commander.tick(
            self._now_us,
            sound=sound,
            placed=self.estimator.placed,
            upright=1.0 - 2.0 * (x * x + y * y) > self._upright_cosine,
            landed=self._land_detector.landed,
            target_reached=guidance.target_reached,
        )
        if row is not None:
            self._follow(row)
        if commander.state is State.MISSION:
            self._fly_mission()
        self._refresh_status()
        if self._motors_stand:
            self.output = self._stopped
        elif sound:
            self.output = self._fly(guidance.step(state))
        return self.output.speeds_rad_s

    def arm(self, *, force: bool = False) -> CommandResult:
        """Arm. As in PX4, forcing from outside skips no check.

        Returns:
            ACCEPTED (also when armed already), or TEMPORARILY_REJECTED with a status text that says why.
        """
        del force
        self.prepare()
        return self._command(Event.ARM)

    def disarm(self, *, force: bool = False) -> CommandResult:
        """Disarm: on the ground, or anywhere at once if forced.

        Returns:
            ACCEPTED, or TEMPORARILY_REJECTED in the air.
        """
        return self._command(Event.FORCE_DISARM if force else Event.DISARM)

    def terminate(self) -> CommandResult:
        """Stop the motors for good, wherever it is; always ACCEPTED."""
        return self._command(Event.TERMINATE)

    def set_mode(self, mode: FlightMode) -> CommandResult:
        """Change the mode: disarmed always; armed, only to one that can be flown now.

        Returns:
            ACCEPTED, or TEMPORARILY_REJECTED with a status text that says why.
        """
        if mode is FlightMode.TAKEOFF:
            self._entry.takeoff_altitude_m = nan
        if mode is FlightMode.ORBIT:
            self._entry.orbit = self.orbit_here()
        return self._command(MODE_EVENT[mode])

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
        self._entry.takeoff_altitude_m = altitude_amsl_m
        return self._command(Event.SET_TAKEOFF)

    def land(self) -> CommandResult:
        """Land where it is; always ACCEPTED."""
        return self._command(Event.SET_LAND)

    def reposition(self, target_ned_m: Vec3, yaw_rad: float = nan, speed_m_s: float = nan) -> CommandResult:
        """Fly to a place and hold there.

        Args:
            target_ned_m: in the local frame, shape (3,); NaN components: where it holds, or has braked.
            yaw_rad: where to look; NaN: along the way.
            speed_m_s: horizontal; NaN: MPC_XY_CRUISE.

        Returns:
            ACCEPTED, or TEMPORARILY_REJECTED when hold cannot be entered.
        """
        breach = self._navigator.breach_at(target_ned_m) if not any(map(isnan, target_ned_m)) else None
        if breach is not None:
            self.say(WARNING, f"Reposition denied: {breach.text}")
            return CommandResult.DENIED
        result = self._command(Event.SET_HOLD)
        nowhere = self._land_detector.landed and all(map(isnan, target_ned_m))
        if result is CommandResult.ACCEPTED and self.status.armed and not nowhere:
            self._guidance.enter_journey(self.state, target_ned_m, yaw_rad, speed_m_s)  # also from the ground
        return result

    def orbit(self, orbit: Orbit) -> CommandResult:
        """Circle around a point.

        Returns:
            ACCEPTED, or TEMPORARILY_REJECTED when that cannot be flown now.
        """
        self._entry.orbit = orbit
        return self._command(Event.SET_ORBIT)

    def orbit_here(self) -> Orbit:
        """The circle that is flown when no other was asked for: PX4's, 1 m around where it is."""
        return Orbit(self.state.position_ned_m)

    def change_speed(self, speed_m_s: float) -> CommandResult:
        """Fly the present journey at another horizontal speed; NaN: MPC_XY_CRUISE again."""
        self._guidance.traveller.speed_m_s = speed_m_s
        return CommandResult.ACCEPTED

    def look_at(self, point_ned_m: Vec3 | None) -> CommandResult:
        """On journeys and in hold, turn the nose to a place, shape (3,); None: no more."""
        self._guidance.region_ned_m = point_ned_m
        return CommandResult.ACCEPTED

    def set_home(self, point: GeodeticPoint | None) -> CommandResult:
        """Set home to a place on Earth, or (None) to where the vehicle is."""
        if self._places.projection is None:
            self.say(WARNING, "Set home denied: no position estimate")
            return CommandResult.TEMPORARILY_REJECTED
        if point is None:
            self._places.set_home_here(self.state)
        elif not self._places.set_home(point):
            self.say(WARNING, "Set home denied: not a place on Earth")
            return CommandResult.DENIED
        self._guidance.home_ned_m = self.status.home_ned_m
        return CommandResult.ACCEPTED

    def set_origin(self, point: GeodeticPoint) -> CommandResult:
        """Say where on Earth the local frame's origin is."""
        return CommandResult.ACCEPTED if self._places.move_origin(point) else CommandResult.DENIED

    def accept_setpoint(self, setpoint: Setpoint) -> None:
        """Take an offboard setpoint; it is flown in OFFBOARD and lets OFFBOARD be entered.

        One that says nothing that can be flown counts as none received; a status text says so, once until a
        usable one comes.
        """
        if self.intake.offer(setpoint, self._now_us):
            self._commander.setpoint_came(setpoint.time_us)

    def manual_input(self, sticks: ManualInput) -> None:
        """Take a pilot's sticks; moved in a mode that flies itself, they take over (COM_RC_OVERRIDE)."""
        self._guidance.sticks = sticks
        self._commander.sticks_came()
        state = self._commander.state
        if self._motors_stand or state in _BY_HAND or self._land_detector.landed:
            return
        threshold = self.parameters.value("COM_RC_STICK_OV") / 100.0
        bit = _OFFBOARD_BIT if state is State.OFFBOARD else _AUTO_BIT
        moved = max(abs(sticks.forward), abs(sticks.right), abs(sticks.yaw)) > threshold
        if moved and self.parameters.integer("COM_RC_OVERRIDE") & bit:
            self._command(Event.PILOT_TAKES_OVER)

    def ground_station_heard(self) -> None:
        """Note a ground station's heartbeat."""
        self._commander.ground_station_heard()

    def follow_target(self, position_ned_m: Vec3, velocity_ned_m_s: Vec3) -> None:
        """Take a report of the target to follow, in the local frame."""
        self._guidance.follower.report(self._now_us, position_ned_m, velocity_ned_m_s)

    def say(self, severity: int, text: str) -> None:
        """Leave a message for people; the oldest go first when nobody takes them.

        Args:
            severity: MAV_SEVERITY.
            text: one line.
        """
        self._texts.append(StatusText(severity, text))

    def take_texts(self) -> list[StatusText]:
        """All messages since the last call, oldest first."""
        texts = list(self._texts)
        self._texts.clear()
        return texts

    def global_position(self) -> GeodeticPoint | None:
        """Where on Earth it believes to be; None before the first usable sample."""
        return self._places.to_geodetic(self.state.position_ned_m)

    def local_position(self, point: GeodeticPoint) -> Vec3 | None:
        """A place on Earth in the local frame, NED metres; None before the origin is known."""
        return self._places.to_local(point)

    def take_issued_commands(self) -> list[IssuedCommand]:
        """What the mission commands others, such as the camera, since the last call."""
        return self._navigator.take_issued()

    def _command(self, event: Event) -> CommandResult:
        self._commander.situation.has_mission = self.missions.valid  # an upload may have come this moment
        row = self._commander.handle(event)
        self._follow(row)
        self._refresh_status()
        return row.result

    def _follow(self, row: Row) -> None:
        """Do what a rule that fired entails."""
        if row.text:
            self.say(row.severity, row.text)
        if row.target is None:
            return
        before, self._state_entered = self._state_entered, row.target
        if before is State.DISARMED:
            self._leave_disarmed()
        self._motors_stand = row.target in _STOPPED_STATES
        if self._motors_stand:
            self.output = self._stopped
            self._lift_off.rest()
        self._update_view()
        if row.target is State.OFFBOARD:
            self.intake.pass_on_now()
        self._entry.enter(row.target, before, row.event)

    def _leave_disarmed(self) -> None:
        self._stabiliser.reset()
        self._places.set_home_here(self.state)
        self._lift_off.arm(self._now_us)
        self.flight.armed_us = self._now_us
        self.flight.takeoff_us = self.flight.landed_us = 0
        self.flight.number += 1

    def _fly(self, command: Command) -> MotorOutput:
        """Motors for a command, with the ground between if it stands."""
        if not self._land_detector.landed or goes_straight_through(command):
            return self._lift_off.fly(self._stabiliser, self.state, command)
        return self._lift_off.stand(
            self._stabiliser,
            self.state,
            command,
            self._guidance.command_down_m_s,
            may_lift=self._commander.state not in _GROUND_STATES or self._guidance.departs(self.state),
            climb_ramp=self._guidance.climb_ramp,
        )

    def _detect_land(self) -> None:
        detector = self._land_detector
        before = detector.landed
        armed = not self._motors_stand
        landed = detector.update(
            self.state,
            armed=armed,
            lifting=self._lift_off.ticks > 0,
            command_down_m_s=self._guidance.command_down_m_s,
            throttle=self.output.throttle,
        )
        if landed == before:
            return
        if landed:
            self.flight.landed_us = self._now_us
        else:
            self.flight.takeoff_us = self._now_us
            self._guidance.traveller.resume()  # what led it off the ground has run ahead
        if armed:
            self.say(INFO, "Landing detected" if landed else "Takeoff detected")

    def _fix_origin(self) -> None:
        if (origin_ned_m := self.estimator.origin_ned_m) is not None:
            self._places.fix_origin(origin_ned_m, self.state)
            self._guidance.home_ned_m = self.status.home_ned_m

    def _fly_mission(self) -> None:
        self._update_view()
        ended = self._navigator.fly_mission(self.state, self._guidance)
        if ended is not None:
            self._follow(self._commander.handle(ended))

    def _update_view(self) -> None:
        landed = self._land_detector.landed
        self._navigator.look(self.state, self.status, self._places, landed=landed)

    def _configure(self) -> None:
        """Take over the parameters; looked up by name only when one has changed."""
        parameters = self.parameters
        self._parameters_version = parameters.version
        self._commander.configure(parameters)
        self._guidance.configure(
            speed_limits(self.airframe, parameters), manners(self.airframe, self.parameters)
        )
        self._watch.configure(parameters)
        self._limit_stabiliser()
        self._lift_off.configure(parameters)
        self._land_detector.configure(parameters)
        tilt_deg = min(parameters.value("FD_FAIL_P"), parameters.value("FD_FAIL_R")) or 180.0  # 0: never
        self._upright_cosine = cos(radians(tilt_deg))

    def _limit_stabiliser(self) -> None:
        value, limits = self.parameters.value, self._stabiliser.limits
        limits.tilt_rad = radians(value("MPC_TILTMAX_AIR"))
        limits.rate_rad_s = radians(min(value("MC_ROLLRATE_MAX"), value("MC_PITCHRATE_MAX")))
        limits.least_thrust, limits.most_thrust = value("MPC_THR_MIN"), value("MPC_THR_MAX")

    def _refresh_status(self) -> None:
        status, commander = self.status, self._commander
        state, intended = commander.state, commander.situation.intended
        if state is not self._shown_state or intended is not status.intended_mode:
            self._shown_state = state
            self._airborne = _AIRBORNE_STATES.get(state, LandedState.IN_AIR)
            status.armed = state is not State.DISARMED
            status.mode = commander.mode
            status.intended_mode = intended
            status.failsafe = commander.failsafe
        status.setpoint = self._guidance.setpoint
        status.landed_state = LandedState.ON_GROUND if self._land_detector.landed else self._airborne
        if status.armed and self._now_us < self._ready_due_us:
            return
        self._ready_due_us = self._now_us + _READY_PERIOD_US
        ready = commander.ready
        status.not_ready = "" if ready else commander.refusal
        if ready and not status.ready and not status.armed:
            self.say(INFO, "Ready for takeoff!")
        status.ready = ready
