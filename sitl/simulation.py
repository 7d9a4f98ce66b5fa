"""A simulated drone with our own autopilot, advanced by ticks.

No clock, socket or thread: the real-time server and lockstep flights both drive it.
"""

from __future__ import annotations

from firmware_py.autopilot import Autopilot
from firmware_py.estimation.inertial_estimator import InertialEstimator
from framerunner.geometry.axes import flip_vector
from framerunner.geometry.vectors import ZERO3, Vec3
from framerunner.vehicle.airframe import Airframe
from framerunner.vehicle.earth_field import earth_field_ned_gauss
from framerunner.vehicle.geodesy import GeodeticPoint, LocalProjection
from scenarios.models import Scenario
from sitl.sensors.assumptions import estimator_settings
from sitl.sensors.specs import SuiteSpec
from sitl.vehicle import SimulatedVehicle
from sitl.world import CONTROL_PERIOD_US


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


class Simulation(SimulatedVehicle):
    """One drone in one scenario, flown by our own autopilot; see `SimulatedVehicle`.

    Attributes:
        autopilot: fed with the world's sensors; its motor speeds drive the world.
    """

    def __init__(self, scenario: Scenario, airframe: Airframe | None = None, seed: int = 0) -> None:
        super().__init__(scenario, airframe, seed)
        suite, place = self._suite, self._place
        self.autopilot = Autopilot(
            self.world.airframe,
            place,
            self.parameters,
            control_period_s=CONTROL_PERIOD_US / 1e6,
            estimator=None if suite.ideal else new_estimator(suite, self._frame_place(suite, place)),
        )

    def _frame_place(self, suite: SuiteSpec, place: GeodeticPoint) -> GeodeticPoint:
        """Where the frame of motion capture is: at the scenario's origin or, received, at the start."""
        pose = suite.external_pose
        if pose is None or pose.source == "simulated":
            return place
        return LocalProjection(place).to_geodetic(self.world.sensors().position_ned_m)

    @property
    def armed(self) -> bool:
        """Whether the autopilot is armed."""
        return self.autopilot.status.armed

    @property
    def failsafes(self) -> tuple[tuple[int, str], ...]:
        """The autopilot's failsafes of the present or last try: vehicle time and text."""
        return self.autopilot.flight.failsafes

    @property
    def local_origin_arena_m(self) -> Vec3 | None:
        """Where the autopilot's local frame has its origin, arena axes; None before it is known."""
        origin = self.autopilot.estimator.origin
        return None if origin is None else flip_vector(LocalProjection(self._place).to_local(origin))

    def tick(self) -> None:
        """Advance by one control period: sense, control, move, judge."""
        sensors = self._begin_tick()
        if self._models is None:
            faulty = self.faults.sensors
            motors = self.autopilot.step(sensors if faulty is None else faulty.change_ideal(sensors))
        else:
            readings, pose = self._read_sensors(sensors)
            if pose is not None:
                self.autopilot.estimator.take_external_pose(pose)
            motors = self.autopilot.step(readings)
        self._end_tick(motors)
