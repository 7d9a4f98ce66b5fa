"""The autopilot: sensors in, motor speeds out. Joins estimator, commander, guidance and stabiliser.

It reads no clock and opens nothing: time is what the sensors say, and who calls it decides how fast.
"""

from __future__ import annotations

from collections import deque
from math import cos, isinf, isnan, nan, radians
from typing import Protocol

from firmware_py.airframe import Airframe
from firmware_py.commander import Commander
from firmware_py.commander_table import INFO, MODE_EVENT, WARNING, Event, Row, State
from firmware_py.estimator import Estimator
from firmware_py.flight_modes import Guidance, speed_limits, usable
from firmware_py.geodesy import LocalProjection
from firmware_py.land_detector import LandDetector
from firmware_py.missions.store import MissionStore
from firmware_py.parameters import Parameters
from firmware_py.status import CommandResult, FlightMode, LandedState, VehicleStatus
from firmware_py.types import (
    BatteryState,
    FlightRecord,
    GeodeticPoint,
    MotorOutput,
    MotorSpeeds,
    RateCommand,
    Sensors,
    Setpoint,
    StatusText,
    Vec3,
    VehicleState,
)

_UPRIGHT_COSINE = cos(radians(75.0))  # of the tilt beyond which there is no recovery
_LIFT_M_S = 0.04  # asked to climb faster than this, it leaves the ground
_LIFT_HELD_TICKS = 125  # half a second: integrals rest while the contact still carries the weight
_TEXTS_KEPT = 100
_READY_PERIOD_US = 100_000  # once armed, whether it could be armed again is of little interest
_SETPOINT_GRID_US = 10_000

_GROUND_MODES = frozenset({State.HOLD, State.LOSS_HOLD, State.LAND, State.LOSS_LAND})
_AIRBORNE_STATES = {
    State.TAKEOFF: LandedState.TAKEOFF,
    State.LAND: LandedState.LANDING,
    State.LOSS_LAND: LandedState.LANDING,
}


class RateStabiliser(Protocol):
    """What the autopilot needs of a stabiliser."""

    def reset(self) -> None:
        """Forget all integrals."""

    def idle(self) -> MotorOutput:
        """Motors turning slowly, standing on the ground."""
        ...

    def step(self, state: VehicleState, command: RateCommand, *, grounded: bool = False) -> MotorOutput:
        """Motor commands for one control period."""
        ...


class _Undesigned:
    """Stands in until the stabiliser is designed; never flown."""

    def reset(self) -> None:
        """Nothing to forget."""

    def idle(self) -> MotorOutput:
        """Not to be called."""
        raise RuntimeError("the stabiliser is not designed yet; call prepare()")

    def step(self, state: VehicleState, command: RateCommand, *, grounded: bool = False) -> MotorOutput:
        """Not to be called."""
        raise RuntimeError("the stabiliser is not designed yet; call prepare()")


class Autopilot:
    """A whole autopilot for one vehicle.

    Attributes:
        airframe: what it flies.
        parameters: what a ground station may change; changes act at the next tick.
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
        """Boot, disarmed.

        Args:
            airframe: what it flies.
            origin: where on Earth the sensors' positions count from.
            parameters: shared with the MAVLink services; defaults if not given.
            control_period_s: time between calls of `step`.
            stabiliser: another one than the airframe's own design, for tests.
        """
        self.airframe = airframe
        self.parameters = parameters if parameters is not None else Parameters()
        self.status = VehicleStatus()
        self.battery = BatteryState()
        self.flight = FlightRecord()
        self.missions = MissionStore()
        self._estimator = Estimator()
        self.state = self._estimator.state
        self._sensor_projection = LocalProjection(origin)
        self._projection: LocalProjection | None = None
        self._period_us = round(control_period_s * 1e6)
        self._now_us = 0
        self._commander = Commander()
        self._guidance = Guidance(speed_limits(airframe, self.parameters))
        self._stabiliser: RateStabiliser = _Undesigned() if stabiliser is None else stabiliser
        self._land_detector = LandDetector((airframe.hover_speed_rad_s / airframe.motor.max_speed_rad_s) ** 2)
        self._stopped = MotorOutput((0.0,) * len(airframe.rotors))
        self.output = self._stopped
        self._state_entered = State.DISARMED
        self._shown_state: State | None = None
        self._airborne = LandedState.IN_AIR
        self._lift_ticks = 0
        self._takeoff_altitude_m = nan
        self._texts: deque[StatusText] = deque(maxlen=_TEXTS_KEPT)
        self._refusal_said = False
        self._next_setpoint: Setpoint | None = None
        self._setpoint_slot = 0
        self._ready_due_us = 0
        self._parameters_version = -1
        self._configure()

    def prepare(self) -> None:
        """Design the stabiliser, if that has not been done; arming does it at the latest.

        It takes some tenths of a second, most of them to import SciPy, so a program in real time does it
        before its clock runs, and after it has sent its first heartbeat.
        """
        if isinstance(self._stabiliser, _Undesigned):
            from firmware_py.control.stabiliser import Stabiliser

            self._stabiliser = Stabiliser(self.airframe, self._period_us / 1e6)

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
        sound = self._estimator.update(sensors)
        if sound:
            self._now_us = max(self._now_us, state.time_us)
            if self._projection is None:
                self._fix_origin()
            self._detect_land()
        else:
            self._now_us += self._period_us
        if self._next_setpoint is not None and self._now_us // _SETPOINT_GRID_US != self._setpoint_slot:
            self._take_setpoint()
        _, x, y, _ = state.attitude
        upright = 1.0 - 2.0 * (x * x + y * y) > _UPRIGHT_COSINE
        row = commander.tick(
            self._now_us,
            sound=sound,
            upright=upright,
            landed=self._land_detector.landed,
            target_reached=guidance.target_reached,
        )
        if row is not None:
            self._follow(row)
        self._refresh_status()
        if commander.state is State.DISARMED:
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

    def set_mode(self, mode: FlightMode) -> CommandResult:
        """Change the mode: disarmed always; armed, OFFBOARD only while setpoints come.

        Returns:
            ACCEPTED, or TEMPORARILY_REJECTED with a status text that says why.
        """
        if mode not in MODE_EVENT:
            self.say(WARNING, f"Mode change refused: {mode.name.lower()} cannot be flown here")
            return CommandResult.TEMPORARILY_REJECTED
        if mode is FlightMode.TAKEOFF:
            self._takeoff_altitude_m = nan
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
        self._takeoff_altitude_m = altitude_amsl_m
        return self._command(Event.SET_TAKEOFF)

    def land(self) -> CommandResult:
        """Land where it is; always ACCEPTED."""
        return self._command(Event.SET_LAND)

    def accept_setpoint(self, setpoint: Setpoint) -> None:
        """Take an offboard setpoint; it is flown in OFFBOARD and lets OFFBOARD be entered.

        One with neither a position nor a velocity (acceleration alone is not followed) counts as none
        received; a status text says so, once until a usable one comes.

        Setpoints are flown from the next multiple of 10 ms on. So a few milliseconds that a packet takes
        more or less change nothing, nor does one that is sent again, and a flight over a network repeats as
        well as one without.
        """
        if not usable(setpoint):
            if not self._refusal_said:
                self._refusal_said = True
                self.say(WARNING, "Offboard setpoint ignored: no position or velocity")
            return
        self._refusal_said = False
        self._commander.setpoint_came(setpoint.time_us)
        self._next_setpoint = setpoint
        self._setpoint_slot = self._now_us // _SETPOINT_GRID_US

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
        return None if self._projection is None else self._projection.to_geodetic(self.state.position_ned_m)

    def local_position(self, point: GeodeticPoint) -> Vec3 | None:
        """A place on Earth in the local frame, NED metres; None before the origin is known."""
        return None if self._projection is None else self._projection.to_local(point)

    def _command(self, event: Event) -> CommandResult:
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
            self._stabiliser.reset()
            self._set_home()
        match row.target:
            case State.DISARMED:
                self.output = self._stopped
                self._lift_ticks = 0
            case State.HOLD | State.LOSS_HOLD:
                reached = before is State.TAKEOFF and row.event is Event.TICK
                self._guidance.enter_hold(self.state, keep_target=reached)
            case State.LAND | State.LOSS_LAND:
                self._guidance.enter_land(self.state)
            case State.OFFBOARD:
                self._take_setpoint()
                self._guidance.enter_offboard()
            case State.TAKEOFF:
                self._enter_takeoff()

    def _take_setpoint(self) -> None:
        if self._next_setpoint is not None:
            self._guidance.accept(self._next_setpoint)
            self._next_setpoint = None

    def _enter_takeoff(self) -> None:
        here, home = self.global_position(), self.status.home
        if here is None or home is None:  # cannot be: it is armed, so a position has come
            return
        altitude_m = self._takeoff_altitude_m
        if isnan(altitude_m):
            height_m = self.parameters.value("MIS_TAKEOFF_ALT")
            altitude_m = home.altitude_m + height_m
            self.say(INFO, f"Using default takeoff altitude: {height_m:.1f} m")
        if altitude_m < here.altitude_m:
            self.say(WARNING, "Already higher than takeoff altitude")
        climb_m = altitude_m - here.altitude_m
        self._guidance.enter_takeoff(self.state, self.state.position_ned_m[2] - climb_m)

    def _fly(self, command: RateCommand) -> MotorOutput:
        """Motors for a command: on the ground they idle until a mode that may take off wants to climb."""
        if not self._land_detector.landed:
            self._lift_ticks = 0
            return self._stabiliser.step(self.state, command)
        down_m_s = command.velocity_level_m_s[2]
        if self._commander.state in _GROUND_MODES or down_m_s > -_LIFT_M_S:
            self._lift_ticks = 0
            self._stabiliser.reset()
            return self._stabiliser.idle()
        self._lift_ticks += 1
        straight_up = RateCommand((0.0, 0.0, down_m_s), 0.0)
        return self._stabiliser.step(self.state, straight_up, grounded=self._lift_ticks <= _LIFT_HELD_TICKS)

    def _detect_land(self) -> None:
        detector = self._land_detector
        before = detector.landed
        armed = self._commander.state is not State.DISARMED
        landed = detector.update(
            self.state,
            armed=armed,
            lifting=self._lift_ticks > 0,
            command_down_m_s=self._guidance.command_down_m_s,
            throttle=self.output.throttle,
        )
        if armed and landed != before:
            self.say(INFO, "Landing detected" if landed else "Takeoff detected")

    def _fix_origin(self) -> None:
        origin_ned_m = self._estimator.origin_ned_m
        if origin_ned_m is None:
            return
        self.status.origin = self._sensor_projection.to_geodetic(origin_ned_m)
        self._projection = LocalProjection(self.status.origin)
        self._set_home()

    def _set_home(self) -> None:
        self.status.home = self.global_position()
        self.status.home_ned_m = self.state.position_ned_m

    def _configure(self) -> None:
        """Take over the parameters; looked up by name only when one has changed."""
        self._parameters_version = self.parameters.version
        self._commander.configure(self.parameters)
        self._guidance.limits = speed_limits(self.airframe, self.parameters)

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
        if ready and not status.ready and not status.armed:
            self.say(INFO, "Ready for takeoff!")
        status.ready = ready
