"""A simulated drone that ArduPilot flies: its state out as JSON, pulse widths in."""

from __future__ import annotations

from math import isnan

from firmware_py.airframe import Airframe
from firmware_py.measurements import ImuSample
from firmware_py.types import Sensors
from geometry.vectors import Vec3
from scenarios.models import Scenario
from sitl.ardupilot.json_interface import encode_state
from sitl.vehicle import SimulatedVehicle
from sitl.world import PHYSICS_PERIOD_US, STEPS_PER_CONTROL

PULSE_MIN_US, PULSE_MAX_US = 1000, 2000  # of the motors, as the parameters say
_OUT_OF_RANGE_M = -1.0  # a distance below zero is none for ArduPilot


class ArduPilotSimulation(SimulatedVehicle):
    """One drone in one scenario, flown by ArduPilot; see `SimulatedVehicle`.

    ArduPilot simulates GPS, barometer and compass itself, from the true position and attitude. Of the
    scenario's sensors it gets the inertial ones and the range finder, with their errors and faults; with
    ideal sensors, the true motion.

    It is stepped at the rate of the physics, twice a control period: ArduPilot takes one sample of its
    gyroscopes a step, and needs 1.8 times as many as loops.
    """

    autopilot_name = "ArduPilot"

    def __init__(self, scenario: Scenario, airframe: Airframe | None = None, seed: int = 0) -> None:
        super().__init__(scenario, airframe, seed)
        self._armed = False
        motor = self.world.airframe.motor
        self._rotors = len(self.world.airframe.rotors)
        self._speed_a_pulse = motor.max_speed_rad_s / (PULSE_MAX_US - PULSE_MIN_US)
        self._steps = 0  # of the physics, since the last end of a control period
        self._range_m: float | None = None
        self._imu: ImuSample | None = None
        self._true = self._begin_tick()

    @property
    def armed(self) -> bool:
        """Whether ArduPilot turns the motors, which it does while it is armed."""
        return self._armed

    @property
    def local_origin_arena_m(self) -> Vec3 | None:
        """None: ArduPilot's local frame begins where its estimator first had a position."""
        return None

    def step(self, pulses_us: tuple[int, ...]) -> bytes:
        """Advance by one step of the physics with these pulse widths; returns the line with the state then.

        The first pulses are the motors'. A motor's speed is proportional to its pulse above the minimum
        (ArduPilot's MOT_THST_EXPO is 1 then).
        """
        world, scale = self.world, self._speed_a_pulse
        speeds = tuple(
            [scale * max(0, min(pulse, PULSE_MAX_US) - PULSE_MIN_US) for pulse in pulses_us[: self._rotors]]
        )
        if self._steps == 0:
            world.begin_step(speeds)
        else:
            world.dynamics.command_motors(speeds)
        world.run_physics()
        self._steps += 1
        if self._steps < STEPS_PER_CONTROL:
            return self._line_between()
        self._steps = 0
        self._armed = max(speeds) > 0.0
        world.end_step()
        self._judge()
        self._true = self._begin_tick()
        if self._sensing is not None:
            self._take_readings()
        return self._line(self._true)

    def _line_between(self) -> bytes:
        """The state within a control period; sensors with errors deliver once a period."""
        dynamics = self.world.dynamics
        velocity, attitude, rate, force = dynamics.motion()
        time_us = self.world.time_us + self._steps * PHYSICS_PERIOD_US
        return self._line(Sensors(time_us, dynamics.position_ned_m(), velocity, attitude, rate, force))

    def _take_readings(self) -> None:
        readings, _pose = self._read_sensors(self._true)
        self._imu = readings.imu or self._imu
        if readings.range_finder is not None:
            distance_m = readings.range_finder.distance_m
            self._range_m = _OUT_OF_RANGE_M if isnan(distance_m) else distance_m

    def _line(self, true: Sensors) -> bytes:
        imu = self._imu
        return encode_state(
            true.time_us,
            angular_rate_frd_rad_s=true.angular_rate_frd_rad_s if imu is None else imu.angular_rate_frd_rad_s,
            specific_force_frd_m_s2=(
                true.specific_force_frd_m_s2 if imu is None else imu.specific_force_frd_m_s2
            ),
            position_ned_m=true.position_ned_m,
            velocity_ned_m_s=true.velocity_ned_m_s,
            attitude=true.attitude,
            range_m=self._range_m,
        )
