"""What the tests of the sensors share: motions, sensors without errors, and statistics of samples."""

import numpy as np

from framerunner.geometry.vectors import ZERO3
from framerunner.vehicle.airframe import GRAVITY_M_S2, load_airframe
from framerunner.vehicle.geodesy import GeodeticPoint
from sitl.sensors.truth import TrueMotion

AIRFRAME = load_airframe("abejorro")
ORIGIN = GeodeticPoint(47.397742, 8.545594, 489.0)
LEVEL = (1.0, 0.0, 0.0, 0.0)
TICK_US = 4000
_ERRORS = ("noise", "bias", "drift", "error", "offset", "misalignment", "hard_iron", "vibration")


def motion(time_us=0, **parts):
    """Hovering at rest, level, 1.5 m above the floor, with rotors that stand still."""
    values = {
        "period_us": TICK_US,
        "position_ned_m": (0.0, 0.0, -1.5),
        "velocity_ned_m_s": ZERO3,
        "attitude": LEVEL,
        "angular_rate_frd_rad_s": ZERO3,
        "specific_force_frd_m_s2": (0.0, 0.0, -GRAVITY_M_S2),
        "motor_speeds_rad_s": (0.0,) * 4,
        "ground_z_m": 0.0,
    }
    return TrueMotion(time_us=time_us, **values | parts)


def without_errors(spec, **changes):
    """A sensor's figures with all errors at zero, then changed."""
    errors = [name for name in type(spec).model_fields if is_error(name)]
    return spec.model_copy(update=dict.fromkeys(errors, 0.0) | changes)


def is_error(name):
    return any(word in name for word in _ERRORS) and "_time_" not in name


def samples(sensor, count, period_us, **parts):
    """Samples of a constant motion at consecutive times."""
    now = motion(**parts)
    found = []
    for index in range(count):
        now.time_us = index * period_us
        sample = sensor.sample(now)
        if sample is not None:
            found.append(sample)
    return found


def allan_deviation(values, period_s, times_s):
    """Overlapping Allan deviation (IEEE Std 952-1997, annex C).

    values: shape (n, axes). Returns the deviation over all axes at each averaging time, shape (times,).
    """
    sums = np.vstack([np.zeros(values.shape[1]), np.cumsum(values, axis=0)]) * period_s
    found = []
    for time_s in times_s:
        width = round(time_s / period_s)
        second = sums[2 * width :] - 2 * sums[width:-width] + sums[: -2 * width]
        found.append(np.sqrt(np.mean(second**2) / 2.0) / (width * period_s))
    return np.array(found)


def autocorrelation(values, lag):
    """Of samples with zero mean, shape (n, ...), over all components."""
    return np.mean(values[lag:] * values[: len(values) - lag]) / np.mean(values**2)
