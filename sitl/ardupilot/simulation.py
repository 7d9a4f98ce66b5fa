"""A simulated drone that ArduPilot flies: its state out as JSON, pulse widths in."""

from __future__ import annotations

from firmware_py.airframe import Airframe
from geometry.vectors import Vec3
from scenarios.models import Scenario
from sitl.ardupilot.json_interface import encode_state
from sitl.vehicle import SimulatedVehicle

PULSE_MIN_US, PULSE_MAX_US = 1000, 2000  # of the motors, as the parameters say


class ArduPilotSimulation(SimulatedVehicle):
    """One drone in one scenario, flown by ArduPilot; see `SimulatedVehicle`.

    ArduPilot simulates GPS, barometer and compass itself, from the true position and attitude. Of the
    scenario's sensors it gets the inertial ones and the range finder, with their errors and faults; with
    ideal sensors, the true motion.

    A tick has two halves: `move`, with ArduPilot's outputs, and `sense`, whose line is the answer.
    """

    def __init__(self, scenario: Scenario, airframe: Airframe | None = None, seed: int = 0) -> None:
        super().__init__(scenario, airframe, seed)
        self._armed = False
        self._still = (0.0,) * len(self.world.airframe.rotors)
        self._max_speed_rad_s = self.world.airframe.motor.max_speed_rad_s
        self._range_m: float | None = None
        self._rates: Vec3 | None = None
        self._force: Vec3 | None = None
        self._true = self._begin_tick()

    @property
    def armed(self) -> bool:
        """Whether ArduPilot turns the motors, which it does while it is armed."""
        return self._armed

    @property
    def local_origin_arena_m(self) -> Vec3 | None:
        """None: ArduPilot's local frame begins where its estimator first had a position."""
        return None

    def sense(self) -> bytes:
        """The line with the state now."""
        true = self._true
        rates, force = true.angular_rate_frd_rad_s, true.specific_force_frd_m_s2
        if self._sensing is not None:
            readings, pose = self._sensing.read(true)
            if (faulty := self.faults.sensors) is not None:
                readings, pose = faulty.change(readings, pose)
            if readings.imu is not None:
                self._rates = readings.imu.angular_rate_frd_rad_s
                self._force = readings.imu.specific_force_frd_m_s2
            if readings.range_finder is not None:
                self._range_m = readings.range_finder.distance_m
            rates, force = self._rates or rates, self._force or force
        return encode_state(
            true.time_us,
            angular_rate_frd_rad_s=rates,
            specific_force_frd_m_s2=force,
            position_ned_m=true.position_ned_m,
            velocity_ned_m_s=true.velocity_ned_m_s,
            attitude=true.attitude,
            range_m=self._range_m,
        )

    def move(self, pulses_us: tuple[int, ...]) -> None:
        """Advance by one control period with these pulse widths, of which the first are the motors'.

        A motor's speed is proportional to its pulse above the minimum (ArduPilot's MOT_THST_EXPO is 1 then).
        """
        motors = pulses_us[: len(self._still)]
        self._armed = max(motors) > PULSE_MIN_US
        scale = self._max_speed_rad_s / (PULSE_MAX_US - PULSE_MIN_US)
        self._end_tick(
            tuple([scale * (min(max(pulse, PULSE_MIN_US), PULSE_MAX_US) - PULSE_MIN_US) for pulse in motors])
            if self._armed
            else self._still
        )
        self._true = self._begin_tick()
