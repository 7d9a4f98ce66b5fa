"""A simulated drone that PX4 flies: sensors out as messages, motor commands in."""

from __future__ import annotations

from math import isfinite

from firmware_py.battery import BatteryMonitor
from framerunner.errors import UserError
from framerunner.geometry.vectors import ZERO3, Vec3
from framerunner.vehicle.airframe import Airframe
from framerunner.vehicle.measurements import BatteryState
from scenarios.faults.declaration import FaultKind, FaultPart
from scenarios.models import Scenario
from sitl.px4.simulator_messages import RC_PERIOD_US, ActuatorControls, SensorMessages, has_whole_imu
from sitl.px4.transmitter import CENTRED, Channels, Sticks, centred
from sitl.px4.words import FailsafeWords
from sitl.vehicle import SimulatedVehicle


class MotionError(UserError):
    """The drone's motion cannot be simulated on; the message is one line for people."""


class Px4Simulation(SimulatedVehicle):
    """One drone in one scenario, flown by PX4; see `SimulatedVehicle`. Its sensors must not be ideal.

    A tick has two halves: `sense`, whose messages are sent, and `move`, with PX4's answer to them.

    Args:
        transmitter: the operator's; None: there is none, unless the scenario has a fault of it.

    Attributes:
        messages: packs what `sense` returns.
        words: what PX4 does about failures.
        is_answered: PX4 answers the HIL_SENSOR of this tick; without rates and forces it computes no outputs.
    """

    autopilot_name = "PX4"

    def __init__(
        self,
        scenario: Scenario,
        airframe: Airframe | None = None,
        seed: int = 0,
        transmitter: Sticks | None = None,
    ) -> None:
        if transmitter is None and any(fault.part is FaultPart.RC for fault in scenario.faults):
            transmitter = centred
        self.has_transmitter = transmitter is not None
        self._transmitter = transmitter
        self._channels: Channels | None = CENTRED
        super().__init__(scenario, airframe, seed)
        self._monitor = BatteryMonitor(self.world.airframe, self.parameters)
        self._measured = (0.0, 0.0)
        self._last: ActuatorControls | None = None
        self.is_answered = True
        self.words = FailsafeWords()
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

    @property
    def needs_place_on_earth(self) -> bool:
        """Whether PX4 must be told where on Earth it is.

        With GPS it knows. With a compass it would expect another magnetic field, and refuse to arm.
        """
        return self._suite.gps is None and self._suite.magnetometer is None

    def sense(self) -> bytes:
        """The messages of this tick; begins it."""
        true = self._begin_tick()
        readings, pose = self._read_sensors(true)
        self._measured = (readings.battery_voltage_v, readings.battery_current_a)
        self.is_answered = has_whole_imu(readings)
        rc = None
        if self._transmitter is not None and readings.time_us % RC_PERIOD_US == 0:
            rc = self._received(self._transmitter)
        return self.messages.pack(readings, pose, true, rc)

    @property
    def failsafes(self) -> tuple[tuple[int, str], ...]:
        """PX4's failsafes of the present or last try: vehicle time and text."""
        return tuple(self.words.failsafes)

    def measured_battery(self) -> BatteryState | None:
        """The battery as its monitor measures it now; None: it measures nothing."""
        voltage_v, current_a = self._measured
        if voltage_v <= 0.0:
            return None
        self._monitor.update(self.time_us, voltage_v, current_a)
        return self._monitor.state

    def _received(self, transmitter: Sticks) -> Channels | None:
        """What the receiver of the remote control delivers; None: nothing."""
        channels, fault = transmitter(), self.faults.rc
        if fault is None:
            self._channels = channels
        return None if fault is not None and fault.kind is FaultKind.OFF else self._channels

    def move(self, controls: ActuatorControls | None) -> None:
        """End the tick with PX4's outputs; None: there are none, and the motors stand.

        A motor's speed is proportional to its output (PX4's THR_MDL_FAC is 1 then); NaN stops it.

        Raises:
            MotionError: the physics has diverged.
        """
        if not isfinite(sum(self.truth.position_arena_m)):
            time_s = self.time_us / 1e6
            raise MotionError(f"at {time_s:.1f} s the drone turned too fast to be simulated; its try ends")
        if controls is None and not self.is_answered:
            controls = self._last  # the outputs stay as they are
        self._last = controls
        self.words.set_armed(controls is not None and controls.armed)
        if controls is None or not controls.armed:
            self._armed = False
            self._end_tick(self._still)
            return
        self._armed = True
        full = self._max_speed_rad_s
        outputs = controls.controls[: len(self._still)]
        self._end_tick(tuple([full * min(max(0.0, output), 1.0) for output in outputs]))
