"""World, autopilot, battery, failures and referee joined into one simulation that advances by ticks.

No clock, socket or thread: the real-time server and lockstep flights both drive it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import nan

from firmware_py.airframe import Airframe, load_airframe
from firmware_py.autopilot import Autopilot
from firmware_py.estimation.earth_field import earth_field_ned_gauss
from firmware_py.estimation.inertial_estimator import InertialEstimator
from firmware_py.geodesy import LocalProjection
from firmware_py.measurements import ExternalPose, Readings
from firmware_py.parameters import Parameters
from firmware_py.types import GeodeticPoint, Sensors
from geometry.axes import flip_vector
from geometry.vectors import ZERO3, Vec3
from scenarios.models import Scenario, ground_height
from scenarios.referee import Referee
from sitl.battery import Battery
from sitl.sensors.assumptions import estimator_settings, parameter_defaults
from sitl.sensors.specs import SuiteSpec
from sitl.sensors.suite import SensorSuite, load_suite
from sitl.sensors.truth import MotionTracker
from sitl.world import CONTROL_PERIOD_US, World

_BATTERY_PERIOD_US = 100_000
_UNIT_GPS, _UNIT_BATTERY, _UNIT_MOTOR = 4, 100, 101  # FAILURE_UNIT
_OK, _OFF, _STUCK = 0, 1, 2  # FAILURE_TYPE


class Failures:
    """Injected failures: of motors, of the position sensor, of the battery's measurement.

    Args:
        world: whose motors fail.

    Attributes:
        falsify: changes each sample of the sensors as the failures do; None without a failed sensor.
    """

    def __init__(self, world: World) -> None:
        self._world = world
        self._failed: set[int] = set()
        self.falsify: Callable[[Sensors], Sensors] | None = None

    def inject(self, unit: int, kind: int, instance: int) -> bool:
        """Make a part fail or work again, numbered from 1 (0: all); False if that is not supported."""
        if unit == _UNIT_MOTOR:
            return self._inject_motor(kind, instance)
        if unit not in (_UNIT_GPS, _UNIT_BATTERY) or kind not in (_OK, _OFF) or instance > 1:
            return False
        if kind == _OFF:
            self._failed.add(unit)
        else:
            self._failed.discard(unit)
        self.falsify = self._falsified if self._failed else None
        return True

    def _inject_motor(self, kind: int, instance: int) -> bool:
        count = len(self._world.airframe.rotors)
        if kind not in (_OK, _OFF, _STUCK) or instance > count:
            return False
        for index in range(count) if instance == 0 else (instance - 1,):
            if kind == _OK:
                self._world.dynamics.repair_motor(index)
            else:
                self._world.dynamics.fail_motor(index, stuck=kind == _STUCK)
        return True

    def _falsified(self, sensors: Sensors) -> Sensors:
        """Without GPS, only the barometer's height is left; a failed battery measures no voltage."""
        if _UNIT_GPS in self._failed:
            sensors = replace(
                sensors,
                position_ned_m=(nan, nan, sensors.position_ned_m[2]),
                velocity_ned_m_s=(nan, nan, sensors.velocity_ned_m_s[2]),
            )
        if _UNIT_BATTERY in self._failed:
            sensors = replace(sensors, battery_voltage_v=0.0)
        return sensors


class _Sensing:
    """The sensors of a suite, in a world."""

    def __init__(self, suite: SuiteSpec, world: World, origin: GeodeticPoint, seed: int) -> None:
        airframe = world.airframe
        self._world = world
        self._suite = SensorSuite(suite, airframe, origin, seed)
        self._tracker = MotionTracker(CONTROL_PERIOD_US, airframe.motor.max_speed_rad_s)

    def read(self, true: Sensors) -> tuple[Readings, ExternalPose | None]:
        """What the sensors deliver in the tick of a true state."""
        world = self._world
        x_m, y_m, _ = world.position_arena_m
        motion = self._tracker.update(
            true.time_us,
            true.position_ned_m,
            true.velocity_ned_m_s,
            true.attitude,
            motor_speeds_rad_s=world.dynamics.motor_speeds_rad_s(),
            ground_z_m=ground_height(world.scenario, x_m, y_m),
        )
        readings = self._suite.read(motion, true.battery_voltage_v, true.battery_current_a)
        return readings, self._suite.external_pose()


def new_estimator(suite: SuiteSpec, origin: GeodeticPoint) -> InertialEstimator:
    """An estimator that is set up for a suite.

    Args:
        suite: not an ideal one.
        origin: where on Earth the frame of motion capture is; with GPS the estimator finds out itself.
    """
    field_ned_gauss = ZERO3
    if suite.magnetometer is not None:
        field_ned_gauss = earth_field_ned_gauss(origin.latitude_deg, origin.longitude_deg, origin.altitude_m)
    return InertialEstimator(
        estimator_settings(suite), field_ned_gauss, None if suite.gps is not None else origin
    )


class Simulation:
    """One drone in one scenario.

    Args:
        scenario: the simulated one.
        airframe: the drone; by default the one that the scenario names.
        seed: of everything random.

    Raises:
        SuiteError: the scenario's sensor suite cannot be used.

    Attributes:
        world: the physics.
        autopilot: fed with the world's sensors; its motor speeds drive the world.
        failures: injected ones.
        referee: sees the true state of every control tick; a new one for each try.
        battery: of the drone.
        truth: the true state now.
    """

    def __init__(self, scenario: Scenario, airframe: Airframe | None = None, seed: int = 0) -> None:
        self.scenario = scenario
        airframe = airframe or load_airframe(scenario.airframe)
        self.world = World(scenario, airframe, seed)
        origin = scenario.origin
        place = GeodeticPoint(origin.latitude_deg, origin.longitude_deg, origin.altitude_m)
        self._place = place
        suite = load_suite(scenario.sensors)
        self._sensing = None if suite.ideal else _Sensing(suite, self.world, place, seed)
        self.autopilot = Autopilot(
            airframe,
            place,
            Parameters(defaults={**airframe.parameters, **parameter_defaults(suite)}),
            control_period_s=CONTROL_PERIOD_US / 1e6,
            estimator=None if suite.ideal else new_estimator(suite, self._frame_place(suite, place)),
        )
        self.referee = Referee(scenario, airframe.envelope_m)
        self.failures = Failures(self.world)
        self.battery = Battery(airframe, self.autopilot.parameters)
        self._battery_due_us = 0
        self._sensors = self.world.sensors()
        self.truth = self.world.truth(self._sensors, motors_on=False)
        self.referee.update(self.truth)

    def _frame_place(self, suite: SuiteSpec, place: GeodeticPoint) -> GeodeticPoint:
        """Where the frame of motion capture is: at the scenario's origin or, received, at the start."""
        pose = suite.external_pose
        if pose is None or pose.source == "simulated":
            return place
        return LocalProjection(place).to_geodetic(self.world.sensors().position_ned_m)

    @property
    def time_us(self) -> int:
        """Simulated time, microseconds since the drone was switched on."""
        return self.world.time_us

    @property
    def local_origin_arena_m(self) -> Vec3 | None:
        """Where the autopilot's local frame has its origin, arena axes; None before it is known."""
        origin, place = self.autopilot.estimator.origin, self.scenario.origin
        if origin is None:
            return None
        arena = GeodeticPoint(place.latitude_deg, place.longitude_deg, place.altitude_m)
        return flip_vector(LocalProjection(arena).to_local(origin))

    def true_state(self) -> tuple[Sensors, GeodeticPoint]:
        """The true state, positions from the scenario's origin, and its place on Earth."""
        place = LocalProjection(self._place).to_geodetic(self._sensors.position_ned_m)
        return self._sensors, place

    def tick(self) -> None:
        """Advance by one control period: sense, control, move, judge."""
        falsify = self.failures.falsify
        sensors = self._sensors
        if sensors.time_us >= self._battery_due_us:
            self._discharge(sensors.time_us)
        sensors.battery_voltage_v, sensors.battery_current_a = self.battery.voltage_v, self.battery.current_a
        if falsify is not None:
            sensors = falsify(sensors)
        if self._sensing is None:
            motors = self.autopilot.step(sensors)
        else:
            readings, pose = self._sensing.read(sensors)
            if pose is not None:
                self.autopilot.estimator.take_external_pose(pose)
            motors = self.autopilot.step(readings)
        self.world.step(motors)
        self._sensors = self.world.sensors()
        armed = self.autopilot.status.armed
        if armed and not self.truth.motors_on and self.referee.over:
            self.referee = Referee(self.scenario, self.world.airframe.envelope_m)  # a new try
        self.truth = self.world.truth(self._sensors, motors_on=armed)
        self.referee.update(self.truth)

    def _discharge(self, time_us: int) -> None:
        period_us = _BATTERY_PERIOD_US if self._battery_due_us else 0
        self._battery_due_us = time_us + _BATTERY_PERIOD_US
        armed = self.autopilot.status.armed
        self.battery.step(period_us / 1e6, self.world.dynamics.motor_speeds_rad_s(), armed=armed)
