"""The simulated battery: current, voltage and remaining charge.

The current is the mechanical power of the rotors, torque times speed, over efficiency and voltage, plus that
of the electronics. The voltage at rest falls linearly with the charge; under load it is lower by current
times internal resistance.
"""

from __future__ import annotations

from firmware_py.parameters import Parameters
from framerunner.vehicle.airframe import Airframe
from framerunner.vehicle.measurements import MotorSpeeds

_A_S_PER_MAH = 3.6


class Battery:
    """One battery, full at first.

    Args:
        airframe: declares battery and motors.
        parameters: SIM_BAT_DRAIN and SIM_BAT_MIN_PCT; BAT1_V_CHARGED and BAT1_V_EMPTY.

    Attributes:
        voltage_v: at its terminals.
        current_a: drawn now.
        charge: share of the full charge, 0..1.
        sag: share of the voltage that is lost by a fault, 0..1.
    """

    def __init__(self, airframe: Airframe, parameters: Parameters) -> None:
        self._airframe = airframe
        self._parameters = parameters
        self._version = -1
        self._values = (0.0, 0.0, 0.0, 0.0)
        self.charge = 1.0
        self.current_a = self.sag = 0.0
        self.voltage_v = 0.0
        self.step(0.0, (), armed=False)

    def step(self, period_s: float, motor_speeds_rad_s: MotorSpeeds, *, armed: bool) -> None:
        """Discharge for a period; SIM_BAT_DRAIN discharges by time, only while armed."""
        if self._version != self._parameters.version:
            self._configure()
        drain_s, min_charge, empty_v, charged_v = self._values
        battery, motor = self._airframe.battery, self._airframe.motor
        rest_v = battery.cells * (empty_v + self.charge * (charged_v - empty_v))
        power_w = motor.torque_nm_s2 * sum([abs(speed) ** 3 for speed in motor_speeds_rad_s])
        self.current_a = battery.electronics_a + power_w / (battery.efficiency * rest_v)
        self.voltage_v = (rest_v - battery.resistance_ohm * self.current_a) * (1.0 - self.sag)
        if drain_s > 0.0:
            used = period_s / drain_s if armed else 0.0
        else:
            used = self.current_a * period_s / (battery.capacity_mah * _A_S_PER_MAH)
        # The charge never rises, also when its minimum is raised later.
        self.charge = max(self.charge - used, min(min_charge, self.charge))

    def _configure(self) -> None:
        value = self._parameters.value
        self._version = self._parameters.version
        self._values = (
            value("SIM_BAT_DRAIN"),
            value("SIM_BAT_MIN_PCT") / 100.0,
            value("BAT1_V_EMPTY"),
            value("BAT1_V_CHARGED"),
        )
