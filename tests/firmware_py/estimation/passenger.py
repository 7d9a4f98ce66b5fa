"""An estimator that is fed by a drone's sensors but does not steer it, for tests of the estimator alone."""

from __future__ import annotations

from math import dist, nan, pi, sin

from firmware_py.estimation.error_state import ATTITUDE, POSITION, VELOCITY
from firmware_py.setpoints import BodyVelocitySetpoint
from firmware_py.status import FlightMode
from framerunner.geometry.rotations import multiply
from framerunner.vehicle.geodesy import GeodeticPoint
from framerunner.vehicle.measurements import Readings
from scenarios.loader import load_scenario
from sitl.sensors.suite import SensorSuite, load_suite
from sitl.sensors.truth import MotionTracker
from sitl.simulation import Simulation, new_estimator

TICK_US = 4000
BACK_US = 400_000
AIRFRAMES = {"mocap": "abejorro", "outdoor": "x500", "flow": "x500"}


class Passenger:
    """A flight on ideal sensors with a second estimator on honest ones.

    Attributes:
        dropped: names of what does not reach the estimator: fields of `Readings`, or "external_pose".
        moving: the drone changes its velocity and heading smoothly; else it stops.
    """

    def __init__(self, suite: str, seed: int = 0, *, moving: bool = False) -> None:
        spec, airframe = load_suite(suite), AIRFRAMES[suite]
        scenario = load_scenario("open-field").model_copy(update={"airframe": airframe})
        self.simulation = simulation = Simulation(scenario, seed=seed)
        place = GeodeticPoint(
            scenario.origin.latitude_deg, scenario.origin.longitude_deg, scenario.origin.altitude_m
        )
        body = simulation.world.airframe
        self._sensors = SensorSuite(spec, body, place, seed)
        self._tracker = MotionTracker(TICK_US)
        self.estimator = new_estimator(spec, place)
        self.dropped: set[str] = set()
        self.moving = False
        self._flies = False
        self._history = {}
        self._start = (0.0, 0.0, 0.0)
        self.run(10.0)  # alignment, and the first fix of GPS
        if suite != "mocap":
            self._start = self._true()[2]
        self.estimator.stands = False
        simulation.autopilot.takeoff()
        simulation.autopilot.arm()
        self.run(5.0)
        self.moving, self._flies = moving, True

    def run(self, seconds: float) -> None:
        """Fly on."""
        for _ in range(round(seconds * 1e6 / TICK_US)):
            self._tick()

    def error(self) -> list[float]:
        """True minus estimated of the filter's time: attitude (rad), velocity, position; shape (9,)."""
        into = self.estimator.aiding.target.filter
        attitude, velocity, place = self._history[into.time_us]
        w, x, y, z = into.state.attitude
        w, x, y, z = multiply(attitude, (w, -x, -y, -z))
        turn = [(2.0 if w > 0.0 else -2.0) * part for part in (x, y, z)]
        own_velocity, own_place = into.state.velocity_ned_m_s, into.state.position_ned_m
        moved = [a - b - c for a, b, c in zip(place, self._start, own_place, strict=True)]
        return [*turn, *(a - b for a, b in zip(velocity, own_velocity, strict=True)), *moved]

    def sigma(self, index: int) -> float:
        """The estimated standard deviation of a state."""
        p = self.estimator.aiding.target.filter.covariance.p
        return float(p[index, index]) ** 0.5

    def distance_m(self) -> float:
        """From the estimated to the true place of the present."""
        moved = [a - b for a, b in zip(self._true()[2], self._start, strict=True)]
        return dist(moved, self.estimator.state.position_ned_m)

    def _true(self):
        dynamics = self.simulation.world.dynamics
        return dynamics.attitude(), dynamics.velocity_ned_m_s(), dynamics.position_ned_m()

    def _tick(self) -> None:
        simulation = self.simulation
        true = simulation.world.sensors()
        self._history[true.time_us] = self._true()
        self._history.pop(true.time_us - BACK_US, None)
        motion = self._tracker.update(
            true.time_us,
            true.position_ned_m,
            true.velocity_ned_m_s,
            true.attitude,
            motor_speeds_rad_s=simulation.world.dynamics.motor_speeds_rad_s(),
            ground_z_m=0.0,
        )
        readings, pose = self._sensors.read(motion, 16.0, 1.0)
        if pose is not None and "external_pose" not in self.dropped:
            self.estimator.take_external_pose(pose)
        for name in self.dropped - {"external_pose"}:
            assert name in Readings.__slots__
            setattr(readings, name, None)
        self.estimator.update(readings)
        if self._flies and true.time_us % 48_000 == 0:
            self._steer(true.time_us / 1e6)
        simulation.tick()

    def _steer(self, time_s: float) -> None:
        autopilot, pace = self.simulation.autopilot, 1.0 if self.moving else 0.0
        forward, right, turn = (pace * sin(2 * pi * time_s / period_s) for period_s in (7.0, 9.0, 13.0))
        velocity = (0.9 * forward, 0.6 * right, 0.0)
        autopilot.accept_setpoint(
            BodyVelocitySetpoint(autopilot.state.time_us, velocity, nan, 0.8 * turn, velocity)
        )
        if autopilot.status.mode is not FlightMode.OFFBOARD:
            autopilot.set_mode(FlightMode.OFFBOARD)


HEADING, NORTH, DOWN = ATTITUDE + 2, POSITION, POSITION + 2
NORTHWARD = VELOCITY
