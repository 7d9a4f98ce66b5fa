"""Model of the measurement of the battery's voltage and current."""

from __future__ import annotations

from sitl.sensors.noise import normal_numbers
from sitl.sensors.specs import BatteryMonitorSpec


class BatterySensor:
    """Voltage and current, each with an error of its scale and white noise.

    Args:
        spec: figures of the errors.
        seed: of all random numbers.
    """

    def __init__(self, spec: BatteryMonitorSpec, seed: int) -> None:
        self._noise_v, self._noise_a = spec.voltage_noise_v, spec.current_noise_a
        self._numbers = normal_numbers(seed, "sensors.battery.noise", 2)
        voltage, current = next(normal_numbers(seed, "sensors.battery.scale", 2))
        self._voltage_scale = 1.0 + spec.scale_error * voltage
        self._current_scale = 1.0 + spec.scale_error * current

    def measure(self, voltage_v: float, current_a: float) -> tuple[float, float]:
        """Measured voltage and current, neither below zero."""
        noise_v, noise_a = next(self._numbers)
        return (
            max(0.0, self._voltage_scale * voltage_v + self._noise_v * noise_v),
            max(0.0, self._current_scale * current_a + self._noise_a * noise_a),
        )
