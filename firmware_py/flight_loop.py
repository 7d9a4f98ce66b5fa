"""One control tick of the autopilot: estimate, observe, decide, guide, actuate.

It reads no clock: its time is that of the sensors' samples.
"""

from __future__ import annotations

from collections import deque
from math import cos, isfinite, isnan, nan, radians
from typing import TYPE_CHECKING

from firmware_py.battery import BatteryMonitor
from firmware_py.commander import Commander, Observation
from firmware_py.commander_table import CommanderRow, CommanderState, Event, Trigger
from firmware_py.commands import ControlCommand
from firmware_py.estimation.ideal_estimator import IdealEstimator
from firmware_py.estimation.report import StateEstimator
from firmware_py.estimation.wind import WindEstimator
from firmware_py.ground_contact import LandDetector, LiftOff
from firmware_py.guidance.modes import Guidance
from firmware_py.guidance.orbit import Orbit
from firmware_py.missions.flight import LegKind
from firmware_py.missions.store import MissionStore
from firmware_py.navigator import MissionNavigator
from firmware_py.offboard_requests import SetpointQueue
from firmware_py.parameters import Parameters
from firmware_py.setpoints import Setpoint
from firmware_py.status import CommandResult, LandedState, VehicleStatus
from firmware_py.types import CRITICAL, INFO, WARNING, FlightRecord, MotorOutput, StatusText
from framerunner.geometry.vectors import NAN3, Vec3
from framerunner.vehicle.airframe import Airframe
from framerunner.vehicle.geodesy import GeodeticPoint, GeoReference
from framerunner.vehicle.measurements import MotorSpeeds, Readings, Sensors

if TYPE_CHECKING:
    from firmware_py.control.stabiliser import Stabiliser

_MAX_TEXTS = 100
_CHECK_PERIOD_US = 100_000
_READY_PERIOD_US = 100_000  # of the pre-arm checks while armed

_STAYS_ON_GROUND = frozenset(
    {
        CommanderState.HOLD,
        CommanderState.FAILSAFE_HOLD,
        CommanderState.LAND,
        CommanderState.FAILSAFE_LAND,
        CommanderState.FAILSAFE_DESCEND,
        CommanderState.RETURN,
        CommanderState.FAILSAFE_RETURN,
    }
)
"""States that leave the ground only if their mode flies to a place above."""

_AIRBORNE_STATES = {
    CommanderState.TAKEOFF: LandedState.TAKEOFF,
    CommanderState.LAND: LandedState.LANDING,
    CommanderState.FAILSAFE_LAND: LandedState.LANDING,
    CommanderState.FAILSAFE_DESCEND: LandedState.LANDING,
}
_STOPPED_STATES = frozenset({CommanderState.DISARMED, CommanderState.TERMINATED})
_LEG_ENDS = {LegKind.RETURN: Event.MISSION_RETURNS, LegKind.DONE: Event.MISSION_DONE}


class FlightLoop:
    """Combines estimator, commander, guidance and stabiliser. Only the commander remembers decisions.

    Args:
        airframe: what flies.
        origin: where on Earth the sensors' positions are measured from.
        parameters: shared with the MAVLink services; by default the airframe's defaults.
        control_period_s: time between calls of `step`.
        estimator: for the sensors that there are; None: for ideal ones.
        stabiliser: replaces the airframe's own, for tests.

    Attributes:
        airframe: what flies.
        parameters: a change takes effect at the next tick.
        estimator: of the vehicle's state.
        state: the estimate of the vehicle, updated in place.
        wind: estimates the wind; None with ideal sensors.
        status: arming, mode, home and others, updated in place.
        output: of the last step.
        battery: its state, updated in place.
        flight: times of the present or last flight.
        missions: mission, fence and rally points.
        setpoints: of an offboard controller, as received.
    """

    def __init__(
        self,
        airframe: Airframe,
        origin: GeodeticPoint,
        parameters: Parameters | None = None,
        control_period_s: float = 0.004,
        *,
        estimator: StateEstimator | None = None,
        stabiliser: Stabiliser | None = None,
    ) -> None:
        """Boot, disarmed; see the class for the arguments."""
        self.airframe = airframe
        self.parameters = parameters if parameters is not None else Parameters(defaults=airframe.parameters)
        self.estimator: StateEstimator = IdealEstimator(origin) if estimator is None else estimator
        self.state = self.estimator.state
        self.wind = None if estimator is None else WindEstimator(airframe, control_period_s)
        self.status = VehicleStatus()
        self.output = MotorOutput((0.0,) * len(airframe.rotors))
        self.flight = FlightRecord()
        self.missions = MissionStore()
        self.setpoints = SetpointQueue()
        self._battery = BatteryMonitor(airframe, self.parameters)
        self.battery = self._battery.state
        self._geo = GeoReference()
        self._commander = Commander()
        self._guidance = Guidance(airframe, self.parameters, control_period_s)
        self._navigator = MissionNavigator(self.missions, self.parameters)
        self._stabiliser = stabiliser
        self._lift_off = LiftOff()
        self._land_detector = LandDetector((airframe.hover_speed_rad_s / airframe.motor.max_speed_rad_s) ** 2)
        self._texts: deque[StatusText] = deque(maxlen=_MAX_TEXTS)
        self._period_us = round(control_period_s * 1e6)
        self._now_us = 0  # advances also while samples are unusable
        self._checks_due_us = self._ready_due_us = 0
        self._motors_stopped = self._output_finite = True
        self._state_entered = CommanderState.DISARMED
        self._state_shown: CommanderState | None = None
        self._airborne = LandedState.IN_AIR
        self._configure()

    def prepare(self) -> None:
        """Design the stabiliser, if that has not been done; arming calls it.

        It takes some tenths of a second, mostly for the import of SciPy, so a program in real time calls it
        before its clock runs, after the first heartbeat.
        """
        if self._stabiliser is None:
            from firmware_py.control.stabiliser import Stabiliser

            self._stabiliser = Stabiliser(self.airframe, self._period_us / 1e6)
            self._parameters_version = -1  # sets its limits at the next tick

    def step(self, sensors: Sensors | Readings) -> MotorSpeeds:
        """Fly one control tick.

        Args:
            sensors: this tick's sample. For an unusable one (not finite, not newer than the last) the last
                motor speeds are repeated; after 0.3 s without a usable one the commander stops the motors.

        Returns:
            Rotor speeds in rad/s, in the airframe's order; zeros while disarmed.
        """
        if self.parameters.version != self._parameters_version:
            self._configure()
        usable = self.estimator.update(sensors)
        seen = self._observe(sensors, usable and self._output_finite)
        if self.wind is not None and usable:
            self.wind.step(self.state, flying=not seen.landed)
        commander = self._commander
        row = commander.tick(seen)
        if row is not None:
            self._follow(row)
        if commander.state is CommanderState.MISSION:
            self._advance_mission()
        self._refresh_status()
        if usable and not self._motors_stopped:
            output = self._actuate(self._guidance.step(self.state), seen.landed)
            # One that is not finite never reaches a motor; it counts as a tick without a usable sample.
            self._output_finite = isfinite(sum(output.speeds_rad_s))
            if self._output_finite:
                self.output = output
        return self.output.speeds_rad_s

    def _handle(
        self, event: Trigger, *, takeoff_altitude_m: float | None = None, orbit: Orbit | None = None
    ) -> CommandResult:
        """Take a command, between ticks.

        Args:
            event: what is commanded.
            takeoff_altitude_m: of the next take-off, above mean sea level; NaN: MIS_TAKEOFF_ALT above home.
            orbit: the circle to fly.
        """
        self._commander.note_mission(valid=self.missions.valid)
        self._commander.remember(takeoff_altitude_m, orbit)
        row = self._commander.handle(event)
        self._follow(row)
        self._refresh_status()
        return row.result

    def accept_setpoint(self, setpoint: Setpoint) -> None:
        """Take an offboard setpoint; it is flown in OFFBOARD, which cannot be entered without one.

        An unusable one is ignored; a status text reports the first since a usable one.
        """
        if setpoint.is_usable:
            self.setpoints.put(setpoint, self._now_us)
            self._commander.note_setpoint(setpoint.time_us)
        elif self.setpoints.refuse():
            self.say(WARNING, "Offboard setpoint ignored: nothing in it can be flown")

    def say(self, severity: int, text: str) -> None:
        """Add a status text with MAV_SEVERITY; of texts that are not taken the oldest are dropped."""
        self._texts.append(StatusText(severity, text))

    def take_texts(self) -> list[StatusText]:
        """All status texts since the last call, oldest first."""
        texts = list(self._texts)
        self._texts.clear()
        return texts

    def _publish_places(self) -> None:
        """Update origin and home in status and guidance."""
        status, geo = self.status, self._geo
        status.origin, status.home, status.home_ned_m = geo.origin, geo.home, geo.home_ned_m
        self._guidance.set_home(geo.home_ned_m)

    def _observe(self, sensors: Sensors | Readings, usable: bool) -> Observation:
        state, detector, now_us = self.state, self._land_detector, self._now_us
        has_position = self.estimator.has_position
        if not usable:
            self._now_us = now_us = now_us + self._period_us
        else:
            if state.time_us > now_us:
                self._now_us = now_us = state.time_us
            if self._geo.projection is None:
                self._fix_origin()
            before = detector.landed
            landed = detector.update(
                state,
                armed=not self._motors_stopped,
                lifting=self._lift_off.ticks > 0,
                command_down_m_s=self._guidance.command_down_m_s,
                throttle=self.output.throttle,
                has_position=has_position,
            )
            if landed is not before:
                self._change_ground_contact(landed)
        if now_us >= self._checks_due_us:
            self._check(sensors)
        if self.setpoints.waiting is not None and self.setpoints.is_due(now_us):
            self._guidance.accept(self.setpoints.take())
        _, x, y, _ = state.attitude
        return Observation(
            now_us,
            usable,
            has_position,
            1.0 - 2.0 * (x * x + y * y) > self._upright_cosine,
            detector.landed,
            self._guidance.mode.target_reached,
        )

    def _actuate(self, command: ControlCommand, landed: bool) -> MotorOutput:
        """Motor output for a command, in the air or on the ground."""
        stabiliser = self._stabiliser
        if stabiliser is None:
            raise RuntimeError("the stabiliser is not designed yet; call prepare()")
        lift_off, state, guidance = self._lift_off, self.state, self._guidance
        if not landed or command.is_for_motors:
            return stabiliser.step(state, lift_off.in_air(command, state.time_us))
        lifting = lift_off.on_ground(
            command,
            state.time_us,
            guidance.command_down_m_s,
            may_lift=self._commander.state not in _STAYS_ON_GROUND or guidance.mode.departs(state),
            builds_up_climb=guidance.mode.builds_up_climb,
        )
        if lifting is None:
            stabiliser.reset()
            return stabiliser.idle()
        return stabiliser.step(state, lifting, grounded=lift_off.is_held)

    def _follow(self, row: CommanderRow) -> None:
        """Apply a row that matched."""
        if row.text:
            self.say(row.severity, row.text)
        if row.target is None:
            return
        if row.severity == CRITICAL:
            self.flight.failsafes += ((self._now_us, row.text),)
        before, self._state_entered = self._state_entered, row.target
        if before is CommanderState.DISARMED:
            self._leave_disarmed()
        self._motors_stopped = row.target in _STOPPED_STATES
        self.estimator.stands = row.target is CommanderState.DISARMED
        if self._motors_stopped:
            self.output = MotorOutput((0.0,) * len(self.airframe.rotors))
            self._output_finite = True
            self._lift_off.rest()
        self._navigator.observe(self.state, self._geo, landed=self._land_detector.landed)
        if row.target is CommanderState.OFFBOARD:
            self._guidance.accept(self.setpoints.take())
        self._enter(row.target, before, row.event)

    def _leave_disarmed(self) -> None:
        if self._stabiliser is not None:
            self._stabiliser.reset()
        self._geo.set_home_at(self.state.position_ned_m)
        self._publish_places()
        self._lift_off.arm(self._now_us)
        self.flight.armed_us = self._now_us
        self.flight.takeoff_us = self.flight.landed_us = 0
        self.flight.failsafes = ()
        self.flight.number += 1

    def _enter(self, target: CommanderState, before: CommanderState, event: Trigger) -> None:
        """Start the mode of a state; a state without motors changes no mode."""
        if before is CommanderState.MISSION:
            self._navigator.leave_mission()
        if self._motors_stopped:
            self._navigator.disarmed()
            return
        on_ground = self.status.landed_state is LandedState.ON_GROUND
        if target is CommanderState.FAILSAFE_HOLD and before is CommanderState.TAKEOFF and on_ground:
            return  # as PX4: a take-off that has begun continues to its height and holds there
        reached = before is CommanderState.TAKEOFF and event is Event.TICK
        self._guidance.enter(
            target,
            self.state,
            target_ned_m=self._target_of(target),
            keep_target=reached or event is Event.MISSION_DONE,
            orbit=self._commander.orbit,
        )
        if target is CommanderState.MISSION:
            self._navigator.enter_mission()

    def _target_of(self, target: CommanderState) -> Vec3:
        """The target of a take-off or a return, NED metres; NaN for other states."""
        if target in (CommanderState.RETURN, CommanderState.FAILSAFE_RETURN):
            return self._navigator.return_place() or self._geo.home_ned_m
        here = self._geo.to_geodetic(self.state.position_ned_m)
        if target is not CommanderState.TAKEOFF or here is None or self._geo.home is None:
            return NAN3
        altitude_m = self._commander.takeoff_altitude_m
        if isnan(altitude_m):
            height_m = self.parameters.value("MIS_TAKEOFF_ALT")
            altitude_m = self._geo.home.altitude_m + height_m
            self.say(INFO, f"Using default takeoff altitude: {height_m:.1f} m")
        if altitude_m < here.altitude_m:
            self.say(WARNING, "Already higher than takeoff altitude")
        climb_m = altitude_m - here.altitude_m
        return (nan, nan, self.state.position_ned_m[2] - climb_m)

    def _advance_mission(self) -> None:
        """Fly the mission's next leg, and report its end to the commander."""
        self._navigator.observe(self.state, self._geo, landed=self._land_detector.landed)
        leg = self._navigator.next_leg()
        if leg is None:
            return
        self._guidance.fly_leg(self.state, leg)
        ended = _LEG_ENDS.get(leg.kind)
        if ended is not None:
            self._follow(self._commander.handle(ended))

    def _fix_origin(self) -> None:
        origin = self.estimator.origin
        if origin is not None:
            self._geo.fix_origin(origin)
            self._geo.set_home_at(self.state.position_ned_m)
            self._publish_places()

    def _change_ground_contact(self, landed: bool) -> None:
        if landed:
            self.flight.landed_us = self._now_us
        else:
            self.flight.takeoff_us = self._now_us
            self._guidance.context.trajectory.resume()  # the reference point has moved ahead on the ground
        if not self._motors_stopped:
            self.say(INFO, "Landing detected" if landed else "Takeoff detected")

    def _check(self, sensors: Sensors | Readings) -> None:
        """Check battery, fence and mission."""
        self._checks_due_us = self._now_us + _CHECK_PERIOD_US
        battery, navigator = self._battery, self._navigator
        navigator.observe(self.state, self._geo, landed=self._land_detector.landed)
        battery.update(self._now_us, sensors.battery_voltage_v, sensors.battery_current_a)
        breach = navigator.breach() if self.status.armed else None
        if breach is not None and not self._commander.situation.fence_breached:
            self.say(WARNING, breach)
        self._texts.extend(navigator.take_texts())
        self._commander.note_checks(
            battery_warning=battery.state.warning,
            battery_arms=battery.can_arm,
            has_mission=self.missions.valid,
            fence_breached=breach is not None,
            problem="" if self.status.armed else self.estimator.report().problem,
        )

    def _configure(self) -> None:
        """Apply the parameters, when one has changed."""
        parameters, airframe = self.parameters, self.airframe
        self._parameters_version = parameters.version
        self._commander.configure(parameters)
        self._guidance.configure(airframe, parameters)
        self._battery.configure(airframe, parameters)
        if self._stabiliser is not None:
            value, limits = parameters.value, self._stabiliser.limits
            limits.limit_tilt(radians(value("MPC_TILTMAX_AIR")))
            limits.rate_rad_s = radians(min(value("MC_ROLLRATE_MAX"), value("MC_PITCHRATE_MAX")))
            limits.min_thrust, limits.max_thrust = value("MPC_THR_MIN"), value("MPC_THR_MAX")
        self._lift_off.configure(airframe, parameters)
        self._land_detector.configure(parameters)
        tilt_deg = min(parameters.value("FD_FAIL_P"), parameters.value("FD_FAIL_R")) or 180.0  # 0: never
        self._upright_cosine = cos(radians(tilt_deg))

    def _refresh_status(self) -> None:
        status, commander = self.status, self._commander
        state, intended = commander.state, commander.situation.intended
        if state is not self._state_shown or intended is not status.intended_mode:
            self._state_shown = state
            self._airborne = _AIRBORNE_STATES.get(state, LandedState.IN_AIR)
            status.armed = state is not CommanderState.DISARMED
            status.mode = commander.mode
            status.intended_mode = intended
            status.failsafe = commander.failsafe
        status.setpoint = self._guidance.mode.setpoint
        status.landed_state = LandedState.ON_GROUND if self._land_detector.landed else self._airborne
        if status.armed and self._now_us < self._ready_due_us:
            return
        self._ready_due_us = self._now_us + _READY_PERIOD_US
        status.not_ready = commander.refusal
        ready = not status.not_ready
        if ready and not status.ready and not status.armed:
            self.say(INFO, "Ready for takeoff!")
        status.ready = ready
