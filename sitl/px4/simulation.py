"""A simulated drone that PX4 flies: sensors out as messages, motor commands in."""

from __future__ import annotations

from firmware_py.airframe import Airframe
from geometry.vectors import ZERO3, Vec3
from scenarios.models import Scenario
from sitl.px4.messages import ActuatorControls
from sitl.px4.sensor_messages import SensorMessages
from sitl.vehicle import SimulatedVehicle


class Px4Simulation(SimulatedVehicle):
    """One drone in one scenario, flown by PX4; see `SimulatedVehicle`. Its sensors must not be ideal.

    A tick has two halves: `sense`, whose messages are sent, and `move`, with PX4's answer to them.

    Attributes:
        messages: packs what `sense` returns.
    """

    def __init__(self, scenario: Scenario, airframe: Airframe | None = None, seed: int = 0) -> None:
        super().__init__(scenario, airframe, seed)
        self.messages = SensorMessages(self._suite.range_finder, self._place)
        self._armed = False
        rotors, motor = len(self.world.airframe.rotors), self.world.airframe.motor
        self._still = (0.0,) * rotors
        self._max_speed_rad_s = motor.max_speed_rad_s

    @property
    def armed(self) -> bool:
        """Whether PX4 is armed."""
        return self._armed

    @property
    def local_origin_arena_m(self) -> Vec3 | None:
        """Where PX4's local frame has its origin: that of motion capture; with GPS it is not known here."""
        return ZERO3 if self._suite.external_pose is not None else None

    def sense(self) -> bytes:
        """The messages of this tick; begins it."""
        true = self._begin_tick()
        readings, pose = self._read_sensors(true)
        return self.messages.pack(readings, pose, true)

    def move(self, controls: ActuatorControls | None) -> None:
        """End the tick with PX4's outputs; None: there are none, and the motors stand.

        A motor's speed is proportional to its output (PX4's THR_MDL_FAC is 1 then); NaN stops it.
        """
        if controls is None or not controls.armed:
            self._armed = False
            self._end_tick(self._still)
            return
        self._armed = True
        full = self._max_speed_rad_s
        outputs = controls.controls[: len(self._still)]
        self._end_tick(tuple([full * min(max(0.0, output), 1.0) for output in outputs]))
