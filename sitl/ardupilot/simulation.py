"""A simulated drone that ArduPilot flies: its state out as JSON, pulse widths in."""

from __future__ import annotations

from dataclasses import replace
from math import isnan

from framerunner.geometry.vectors import ZERO3, Vec3
from framerunner.vehicle.airframe import Airframe
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import ExternalPose, FlowSample, ImuSample, Sensors
from scenarios.models import Scenario
from sitl.ardupilot.json_interface import encode_state
from sitl.sensors.specs import SuiteSpec
from sitl.vehicle import SimulatedVehicle
from sitl.world import PHYSICS_PERIOD_US, STEPS_PER_CONTROL

PULSE_MIN_US, PULSE_MAX_US = 1000, 2000  # of the motors, as the parameters say
_OUT_OF_RANGE_M = -1.0  # a distance below zero is none for ArduPilot


def flies_by_flow(suite: SuiteSpec) -> bool:
    """Whether optical flow says how ArduPilot moves over the ground: nothing better does."""
    return suite.optical_flow is not None and suite.external_pose is None and suite.gps is None


class ArduPilotSimulation(SimulatedVehicle):
    """One drone in one scenario, flown by ArduPilot; see `SimulatedVehicle`.

    ArduPilot simulates GPS, barometer and compass itself, from the true position and attitude. Of the
    scenario's sensors it gets the inertial ones, the range finder, optical flow and the poses of motion
    capture, with their errors and faults; with ideal sensors, the true motion.

    ArduPilot's estimator has no position by flow before it has had flow of some quality and a distance, and
    takes flow for zero until it has taken off. Where the drone stands both sensors are too near the ground to
    measure. So until the range finder first does in the air they deliver the least that counts.

    It is stepped at the rate of the physics, twice a control period: ArduPilot takes one sample of its
    gyroscopes a step, and needs 1.8 times as many as loops.

    Attributes:
        pose: of motion capture that has arrived with the last step; None: none.
        flow: likewise.
    """

    autopilot_name = "ArduPilot"

    def __init__(self, scenario: Scenario, airframe: Airframe | None = None, seed: int = 0) -> None:
        super().__init__(scenario, airframe, seed)
        self._armed = False
        motor = self.world.airframe.motor
        self._rotors = len(self.world.airframe.rotors)
        self._speed_a_pulse = motor.max_speed_rad_s / (PULSE_MAX_US - PULSE_MIN_US)
        self._standing = (PULSE_MIN_US,) * self._rotors
        self._steps = 0  # of the physics, since the last end of a control period
        self._range_m: float | None = None
        self._stands = True  # the range finder has measured nothing since it was armed
        self._imu: ImuSample | None = None
        self.pose: ExternalPose | None = None
        self.flow: FlowSample | None = None
        self._true = self._begin_tick()

    @property
    def armed(self) -> bool:
        """Whether ArduPilot turns the motors, which it does while it is armed."""
        return self._armed

    @property
    def local_origin_arena_m(self) -> Vec3 | None:
        """That of motion capture; with GPS it is where ArduPilot's estimator first had a position."""
        return ZERO3 if self._suite.external_pose is not None else None

    @property
    def place(self) -> GeodeticPoint:
        """The scenario's origin on Earth."""
        return self._place

    @property
    def sends_sensors(self) -> bool:
        """Whether it has sensors that ArduPilot takes over MAVLink."""
        pose = self._suite.external_pose
        return flies_by_flow(self._suite) or (pose is not None and pose.source == "simulated")

    @property
    def is_at_control_tick(self) -> bool:
        """Whether a control period has ended and the next one has not begun."""
        return self._steps == 0

    def coast(self) -> None:
        """Advance to the end of the control period with standing motors."""
        self.step(self._standing)
        while not self.is_at_control_tick:
            self.step(self._standing)

    def step(self, pulses_us: tuple[int, ...]) -> bytes:
        """Advance by one step of the physics with these pulse widths; returns the line with the state then.

        The first pulses are the motors'. A motor's speed is proportional to its pulse above the minimum
        (ArduPilot's MOT_THST_EXPO is 1 then).
        """
        self.pose = self.flow = None
        world, scale = self.world, self._speed_a_pulse
        speeds = tuple(
            [scale * max(0, min(pulse, PULSE_MAX_US) - PULSE_MIN_US) for pulse in pulses_us[: self._rotors]]
        )
        if self._steps == 0:
            world.begin_step(speeds)
        else:
            world.command_motors(speeds)
        world.run_physics()
        self._steps += 1
        if self._steps < STEPS_PER_CONTROL:
            return self._line_between()
        self._steps = 0
        self._armed = max(speeds) > 0.0
        world.end_step()
        self._judge()
        self._true = self._begin_tick()
        if self._models is not None:
            self._take_readings()
        return self._line(self._true)

    def _line_between(self) -> bytes:
        """The state within a control period; sensors with errors deliver once a period."""
        dynamics = self.world.dynamics
        velocity, attitude, rate, force = dynamics.motion()
        time_us = self.world.time_us + self._steps * PHYSICS_PERIOD_US
        return self._line(Sensors(time_us, dynamics.position_ned_m(), velocity, attitude, rate, force))

    def _take_readings(self) -> None:
        readings, self.pose = self._read_sensors(self._true)
        self._imu = readings.imu or self._imu
        self._stands = self._stands or not self._armed
        if readings.range_finder is not None:
            self._range_m = self._range_for_ardupilot(readings.range_finder.distance_m)
        self.flow = readings.optical_flow
        if self.flow is not None and self._stands:
            self.flow = replace(self.flow, quality=max(1, self.flow.quality))

    def _range_for_ardupilot(self, distance_m: float) -> float:
        """A distance as ArduPilot takes it."""
        if not isnan(distance_m):
            self._stands = self._stands and not self._armed
            return distance_m
        spec = self._suite.range_finder
        return spec.min_distance_m if spec is not None and self._stands else _OUT_OF_RANGE_M

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
