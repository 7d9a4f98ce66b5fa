"""World, autopilot and referee joined into one thing that advances by ticks.

Still no clock, socket or thread: the real-time server and lockstep flights both drive it.
"""

from __future__ import annotations

from firmware_py.airframe import Airframe, load_airframe
from firmware_py.autopilot import Autopilot
from firmware_py.types import GeodeticPoint
from scenarios.models import Scenario
from scenarios.referee import Referee
from sitl.battery import Battery
from sitl.failures import Failures
from sitl.world import CONTROL_PERIOD_US, World

_BATTERY_PERIOD_US = 100_000


class Simulation:
    """One drone in one scenario.

    Args:
        scenario: what is flown.
        airframe: the drone; by default the one that the scenario names.

    Attributes:
        world: the physics.
        autopilot: what flies.
        failures: what is broken on purpose.
        referee: what judges, fed with the truth of every control tick.
        battery: what feeds the drone.
        truth: the true state now.
    """

    def __init__(self, scenario: Scenario, airframe: Airframe | None = None) -> None:
        self.scenario = scenario
        airframe = airframe or load_airframe(scenario.airframe)
        origin = scenario.origin
        self.world = World(scenario, airframe)
        self.autopilot = Autopilot(
            airframe,
            GeodeticPoint(origin.latitude_deg, origin.longitude_deg, origin.altitude_m),
            control_period_s=CONTROL_PERIOD_US / 1e6,
        )
        self.referee = Referee(scenario, airframe.envelope_m)
        self.failures = Failures(self.world, len(airframe.rotors))
        self.battery = Battery(airframe, self.autopilot.parameters)
        self._battery_due_us = 0
        self._sensors = self.world.sensors()
        self.truth = self.world.truth(self._sensors, motors_on=False)
        self.referee.update(self.truth)

    @property
    def time_us(self) -> int:
        """Simulated time, microseconds since the drone was switched on."""
        return self.world.time_us

    def tick(self) -> None:
        """Advance by one control period: sense, control, move, judge."""
        falsify = self.failures.falsify
        sensors = self._sensors
        if sensors.time_us >= self._battery_due_us:
            self._discharge(sensors.time_us)
        sensors.battery_voltage_v, sensors.battery_current_a = self.battery.voltage_v, self.battery.current_a
        if falsify is not None:
            sensors = falsify(sensors)
        motors = self.autopilot.step(sensors)
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
        self.battery.step(period_us / 1e6, self.world.motor_speeds_rad_s(), armed=armed)
