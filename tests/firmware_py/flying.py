"""A whole autopilot in the simulated world, for tests that fly: no sockets, no clock, every tick recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import acos, atan2, degrees, hypot, nan

from firmware_py.autopilot import Autopilot
from firmware_py.parameters import Parameters
from firmware_py.setpoints import (
    AttitudeSetpoint,
    BodyRateSetpoint,
    BodyVelocitySetpoint,
    MotorSetpoint,
    Setpoint,
    TrajectorySetpoint,
)
from firmware_py.status import CommandResult, FlightMode, LandedState
from firmware_py.types import ManualInput
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.airframe import load_airframe
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import Sensors
from scenarios.models import Scenario
from sitl.world import World

ORIGIN = GeodeticPoint(47.397742, 8.545594, 489.0)
TICKS_PER_S = 250
_STREAM_TICKS = 12  # setpoints and sticks are sent at 20 Hz
_SAMPLE_TICKS = 5
_KINDS = {
    "attitude": AttitudeSetpoint,
    "rate_frd_rad_s": BodyRateSetpoint,
    "outputs": MotorSetpoint,
    "velocity_level_m_s": BodyVelocitySetpoint,
}


@dataclass(frozen=True, slots=True)
class Sample:
    """The true state in one tick, relative to the start position."""

    time_s: float
    position_ned_m: Vec3
    velocity_ned_m_s: Vec3
    yaw_rad: float
    tilt_deg: float
    mode: FlightMode

    @property
    def height_m(self) -> float:
        return -self.position_ned_m[2]

    @property
    def speed_m_s(self) -> float:
        """Horizontal."""
        return hypot(self.velocity_ned_m_s[0], self.velocity_ned_m_s[1])

    def distance_m(self, north_m: float = 0.0, east_m: float = 0.0) -> float:
        """Horizontal distance to a place."""
        return hypot(self.position_ned_m[0] - north_m, self.position_ned_m[1] - east_m)


class Flight:
    """One drone with its autopilot, driven by a test.

    Attributes:
        setpoint: what an offboard controller sends; None: nothing.
        sticks: what an operator sends; None: nothing.
        ground_station: whether one is heard.
        sensed: makes what the autopilot senses of what is true.
        track: what was flown, oldest first.
        texts: what the autopilot told.
    """

    def __init__(
        self, airframe: str = "x500", *, scenario: Scenario | None = None, seed: int = 0, **parameters: float
    ) -> None:
        body = load_airframe(airframe)
        self.world = World(scenario or Scenario(name="field"), body, seed)
        self.autopilot = Autopilot(body, ORIGIN, Parameters(parameters, defaults=body.parameters))
        self.setpoint: Setpoint | None = None
        self.sticks: ManualInput | None = None
        self.ground_station = False
        self.sensed: Callable[[Sensors], Sensors] = lambda sensors: sensors
        self.track: list[Sample] = []
        self.texts: list[str] = []
        self._start_ned_m = self.world.sensors().position_ned_m
        self._ticks = 0
        self.run(1.0)

    @property
    def now(self) -> Sample:
        """The last sample."""
        return self.track[-1]

    @property
    def mode(self) -> FlightMode:
        return self.autopilot.status.mode

    @property
    def armed(self) -> bool:
        return self.autopilot.status.armed

    @property
    def landed(self) -> bool:
        return self.autopilot.status.landed_state is LandedState.ON_GROUND

    @property
    def time_s(self) -> float:
        return self.world.time_us / 1e6

    def run(self, seconds: float, until: Callable[[], object] | None = None) -> list[Sample]:
        """Run for a time, or until a condition holds; return the samples."""
        start = len(self.track)
        for _ in range(round(seconds * TICKS_PER_S)):
            if until is not None and until():
                break
            self._tick()
        self.texts += [text.text for text in self.autopilot.take_texts()]
        return self.track[start:]

    def take(self, seconds: float, until: Callable[[], object]) -> float:
        """Run until a condition holds, which it must within a time; return the duration in seconds."""
        start_s = self.time_s
        self.run(seconds, until)
        assert until(), f"not within {seconds} s: {self.now}, {self.texts[-3:]}"
        return self.time_s - start_s

    def arm(self, mode: FlightMode | None = None) -> None:
        if mode is not None:
            assert self.autopilot.set_mode(mode) is CommandResult.ACCEPTED
        assert self.autopilot.arm() is CommandResult.ACCEPTED, self.autopilot.take_texts()

    def climb_to(self, height_m: float) -> Flight:
        """Take off and hold there."""
        assert self.autopilot.takeoff(self.amsl_m(height_m)) is CommandResult.ACCEPTED
        self.arm()
        self.take(60.0, lambda: self.mode is FlightMode.HOLD)
        self.run(3.0)
        return self

    def fly(self, seconds: float, **setpoint: object) -> list[Sample]:
        """Fly offboard by a setpoint, which is sent repeatedly."""
        self.send(**setpoint)
        if self.mode is not FlightMode.OFFBOARD:
            self._tick()
            assert self.autopilot.set_mode(FlightMode.OFFBOARD) is CommandResult.ACCEPTED
        return self.run(seconds)

    def send(self, **setpoint: object) -> None:
        """Send a setpoint repeatedly from now on."""
        kind = next((_KINDS[name] for name in setpoint if name in _KINDS), TrajectorySetpoint)
        self.setpoint = kind(0, **setpoint)
        self._stream()

    def steer(self, seconds: float, **sticks: float) -> list[Sample]:
        """Hold the sticks; those not given are centred."""
        self.sticks = ManualInput(0, **sticks)
        self._stream()
        return self.run(seconds)

    def amsl_m(self, height_m: float) -> float:
        """The altitude above sea level of a height above the start."""
        assert self.autopilot.status.home is not None
        return self.autopilot.status.home.altitude_m + height_m

    def _stream(self) -> None:
        time_us = self.world.time_us
        if self.setpoint is not None:
            self.autopilot.accept_setpoint(replace(self.setpoint, time_us=time_us))
        if self.ground_station:
            self.autopilot.ground_station_heard()
        if self.sticks is not None:
            self.autopilot.manual_input(replace(self.sticks, time_us=time_us))

    def _tick(self) -> None:
        if self._ticks % _STREAM_TICKS == 0:
            self._stream()
        sensors = self.world.sensors()
        if self._ticks % _SAMPLE_TICKS == 0:
            self.track.append(self._sample(sensors))
        self.world.step(self.autopilot.step(self.sensed(sensors)))
        self._ticks += 1

    def _sample(self, sensors: Sensors) -> Sample:
        w, x, y, z = sensors.attitude
        north, east, down = (
            place - start for place, start in zip(sensors.position_ned_m, self._start_ned_m, strict=True)
        )
        return Sample(
            sensors.time_us / 1e6,
            (north, east, down),
            sensors.velocity_ned_m_s,
            atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
            degrees(acos(max(-1.0, min(1.0, 1 - 2 * (x * x + y * y))))),
            self.mode,
        )


def without_gps(sensors: Sensors) -> Sensors:
    """The sensors without GNSS: horizontal position and velocity are NaN."""
    return replace(
        sensors,
        position_ned_m=(nan, nan, sensors.position_ned_m[2]),
        velocity_ned_m_s=(nan, nan, sensors.velocity_ned_m_s[2]),
    )
