"""A drone in a scenario without its autopilot: world, sensors, battery, faults and referee.

`Simulation` adds our own autopilot to it, `sitl.px4.simulation` PX4. No clock, socket or thread.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

from firmware_py.parameters import Parameters
from framerunner.geometry.vectors import Vec3
from framerunner.vehicle.airframe import Airframe, load_airframe
from framerunner.vehicle.geodesy import GeodeticPoint, LocalProjection
from framerunner.vehicle.measurements import ExternalPose, MotorSpeeds, Readings, Sensors
from scenarios.models import Scenario, ground_height
from scenarios.referee import Referee
from scenarios.result import BegunFault, FailsafeText, FaultFacts
from sitl.battery import Battery
from sitl.faults.faults import Faults
from sitl.payload.gimbal import SimulatedGimbal
from sitl.sensors.assumptions import parameter_defaults
from sitl.sensors.suite import SensorSuite, load_suite
from sitl.sensors.truth import MotionTracker
from sitl.world import CONTROL_PERIOD_US, World

_BATTERY_PERIOD_US = 100_000


class SimulatedVehicle(ABC):
    """One drone in one scenario, flown by the autopilot of a subclass.

    Args:
        scenario: the simulated one.
        airframe: the drone; by default the one that the scenario names.
        seed: of everything random.

    Raises:
        SuiteError: the scenario's sensor suite cannot be used.
        FaultError: a fault of the scenario is one of a part that the drone does not have.

    Attributes:
        scenario: as given.
        seed: as given.
        world: the physics.
        parameters: of the autopilot and of the battery.
        faults: declared in the scenario and injected over MAVLink.
        referee: sees the true state of every control tick; a new one for each try.
        battery: of the drone.
        gimbal: of the camera; None: it is fixed to the drone.
        truth: the true state now.
    """

    autopilot_name = ""  # of a genuine autopilot; empty: our own flies
    has_transmitter = False  # an operator's remote control, which can fail

    def __init__(self, scenario: Scenario, airframe: Airframe | None = None, seed: int = 0) -> None:
        self.scenario, self.seed = scenario, seed
        airframe = airframe or load_airframe(scenario.airframe)
        self.world = World(scenario, airframe, seed)
        origin = scenario.origin
        self._place = place = GeodeticPoint(origin.latitude_deg, origin.longitude_deg, origin.altitude_m)
        self._suite = suite = load_suite(scenario.sensors)
        self._models = None if suite.ideal else SensorSuite(suite, airframe, place, seed)
        self._tracker = MotionTracker(CONTROL_PERIOD_US)
        self.parameters = Parameters(defaults={**airframe.parameters, **parameter_defaults(suite)})
        self.referee = Referee(scenario, airframe.envelope_m)
        self.battery = Battery(airframe, self.parameters)
        self.faults = Faults(
            scenario.faults,
            suite,
            self.world,
            self.battery,
            seed,
            autopilot=self.autopilot_name,
            has_transmitter=self.has_transmitter,
        )
        settings = scenario.camera.gimbal
        self.gimbal = None if settings is None else SimulatedGimbal(settings)
        self._battery_due_us = 0
        self._sensors = self.world.sensors()
        self.truth = self.world.truth(self._sensors, motors_on=False)
        if self.gimbal is not None:
            self._turn_camera(self.gimbal)
        self.referee.update(self.truth)

    @property
    @abstractmethod
    def armed(self) -> bool:
        """Whether the autopilot is armed."""

    @property
    @abstractmethod
    def local_origin_arena_m(self) -> Vec3 | None:
        """Where the autopilot's local frame has its origin, arena axes; None if that is unknown."""

    @property
    def failsafes(self) -> tuple[tuple[int, str], ...]:
        """The autopilot's failsafes of the present or last try: vehicle time and text."""
        return ()

    @property
    def time_us(self) -> int:
        """Simulated time, microseconds since the drone was switched on."""
        return self.world.time_us

    def fault_facts(self) -> FaultFacts:
        """The faults of the present or last try, and the autopilot's failsafes."""
        return FaultFacts(
            begun=tuple(
                BegunFault(fault=str(each.fault), began_us=each.time_us, ended_us=each.ended_us)
                for each in self.faults.begun
            ),
            autopilot=self.autopilot_name,
            failsafes=tuple(FailsafeText(time_us=time_us, text=text) for time_us, text in self.failsafes),
        )

    def true_state(self) -> tuple[Sensors, GeodeticPoint]:
        """The true state, positions from the scenario's origin, and its place on Earth."""
        place = LocalProjection(self._place).to_geodetic(self._sensors.position_ned_m)
        return self._sensors, place

    def _begin_tick(self) -> Sensors:
        """Apply faults and discharge the battery; returns the true state, with the battery's values."""
        faults, sensors = self.faults, self._sensors
        if sensors.time_us >= faults.next_us:
            faults.update(sensors.time_us)
        if sensors.time_us >= self._battery_due_us:
            self._discharge(sensors.time_us)
        sensors.battery_voltage_v, sensors.battery_current_a = self.battery.voltage_v, self.battery.current_a
        return sensors

    def _read_sensors(self, true: Sensors) -> tuple[Readings, ExternalPose | None]:
        """What the sensors deliver in the tick of a true state, with faults; the suite is not ideal."""
        assert self._models is not None, "ideal sensors read nothing"
        x_m, y_m, _ = self.world.position_arena_m
        motion = self._tracker.update(
            true.time_us,
            true.position_ned_m,
            true.velocity_ned_m_s,
            true.attitude,
            motor_speeds_rad_s=self.world.dynamics.motor_speeds_rad_s(),
            ground_z_m=ground_height(self.scenario, x_m, y_m),
        )
        readings, pose = self._models.read(motion, true.battery_voltage_v, true.battery_current_a)
        if (faulty := self.faults.sensors) is not None:
            return faulty.change(readings, pose)
        return readings, pose

    def _end_tick(self, motors: MotorSpeeds) -> None:
        """Move by these motor speeds, and judge."""
        self.world.step(motors)
        self._judge()

    def _judge(self) -> None:
        """Take the true state after a step of the world, and judge it."""
        self._sensors = self.world.sensors()
        armed = self.armed
        if armed is not self.truth.motors_on:
            self._change_arming(armed)
        self.truth = self.world.truth(self._sensors, motors_on=armed)
        if self.gimbal is not None:
            self._turn_camera(self.gimbal)
        self.referee.update(self.truth)

    def _turn_camera(self, gimbal: SimulatedGimbal) -> None:
        gimbal.step(CONTROL_PERIOD_US / 1e6, self._sensors.attitude)
        self.truth.camera = gimbal.motion

    def _change_arming(self, armed: bool) -> None:
        if not armed:
            self.faults.disarmed(self.time_us)
            return
        self.faults.armed(self.time_us)
        self.world.repair()
        if self.referee.over:
            self.referee = Referee(self.scenario, self.world.airframe.envelope_m)  # a new try

    def _discharge(self, time_us: int) -> None:
        period_us = _BATTERY_PERIOD_US if self._battery_due_us else 0
        self._battery_due_us = time_us + _BATTERY_PERIOD_US
        self.battery.step(period_us / 1e6, self.world.dynamics.motor_speeds_rad_s(), armed=self.armed)
