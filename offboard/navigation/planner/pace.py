"""How fast a path is flown at each place: as fast as speeds, accelerations and commands allow.

A path planned in one time is flown in another. The square of the ratio of the speeds has bounds for its
slope, which the real acceleration along the path depends on (as in Bobrow, Dubowsky, Gibson, "Time-optimal
control of robotic manipulators along specified paths", 1985): one pass forward, one back.
"""

from __future__ import annotations

from math import inf, isfinite, sqrt

import numpy as np
import numpy.typing as npt

from offboard.navigation.goals import PRESENT_SHARE, FlightStyle
from offboard.navigation.planner.legs import Array

STEP_S = 0.05
_LEAST = 0.01  # of the squares
_MAIN_SHARE = 0.3  # of the speed; an axis with less does not decide how fast the path may get faster
_SLOW_M_S = 0.05
_LEAST_ALONG = 0.5  # share of a command in plan that is always left along the path


def speed_squares(
    velocities_m_s: Array,
    accelerations_m_s2: Array,
    yaw: Array,
    yaw_rate: Array,
    *,
    near_bars: npt.NDArray[np.bool_],
    style: FlightStyle,
) -> Array:
    """The squares of the speed's ratio to the planned one, 0 to 1; samples are STEP_S of planned time apart.

    The first one is 1: a path starts with the motion given, even if that is too fast. Near an opening's bars
    the ratio does not rise by more than the style allows.
    """
    vx, vy, vz = velocities_m_s.T
    ax, ay, az = accelerations_m_s2.T
    c, s = np.cos(yaw), np.sin(yaw)
    forward, left = c * vx + s * vy, c * vy - s * vx
    level = np.hypot(vx, vy)
    excess = np.maximum(np.abs(forward), np.abs(left)) / style.axis_speed_m_s
    excess = np.maximum(excess, np.abs(vz) / style.climb_speed_m_s)
    excess = np.maximum(excess, level / style.path_speed_m_s)
    crossing = level / (PRESENT_SHARE * style.crossing_speed_m_s)
    excess = np.where(near_bars, np.maximum(excess, crossing), excess)
    most = 1.0 / np.maximum(excess, 1.0) ** 2
    ahead = c * ax + s * ay + yaw_rate * left
    aside = c * ay - s * ax - yaw_rate * forward
    along = (vx * ax + vy * ay) / np.maximum(level, 1e-6)
    limits = [
        (forward, ahead, style.lag_s, np.full(len(level), style.command_m_s)),
        (left, aside, style.lag_s, np.full(len(level), style.command_m_s)),
        (vz, az, style.climb_lag_s, np.full(len(level), style.climb_command_m_s)),
    ]
    if isfinite(style.level_command_m_s):
        across = style.lag_s * most * (forward * aside - left * ahead) / np.maximum(level, 1e-6)
        left_m_s = _beside(across, style.level_command_m_s)
        limits.append((level, along, style.lag_s, left_m_s))
    speed = np.sqrt(level * level + vz * vz)
    rows: list[list[tuple[float, float, float, float]]] = []
    for axis_speed, acceleration, lag_s, command_m_s in limits:
        size = np.abs(axis_speed)
        added = np.where(axis_speed < 0.0, -acceleration, acceleration) * lag_s
        main = size > np.maximum(_MAIN_SHARE * speed, _SLOW_M_S)
        most = np.where(main, most, np.minimum(most, _steady(size, added, command_m_s)))
        rates = np.where(main, 2.0 / (lag_s * np.maximum(size, _SLOW_M_S)), inf)
        columns = size, added, rates, command_m_s
        rows.append(list(zip(*(column.tolist() for column in columns), strict=True)))
    gains = np.where(near_bars, 2.0 * style.crossing_gain_m_s2 / np.maximum(speed, _SLOW_M_S), inf)
    brake = _brakes(velocities_m_s, accelerations_m_s2, speed, style)
    return np.array(_passes(most.tolist(), rows, gains.tolist(), brake))


def _beside(across_m_s: Array, command_m_s: float) -> Array:
    """What of a command in plan is left along the path, beside what a turn of the path needs."""
    rest: Array = np.sqrt(np.maximum(command_m_s**2 - across_m_s**2, (_LEAST_ALONG * command_m_s) ** 2))
    return rest


def _steady(size: Array, added: Array, limit: Array) -> Array:
    """The largest square x with size sqrt(x) + added x <= limit, at most 1."""
    more = np.maximum(added, 1e-6)
    root = (np.sqrt(size * size + 4.0 * more * limit) - size) / (2.0 * more)
    square: Array = np.where(added > 0.0, np.minimum(root, 1.0), 1.0) ** 2
    return square


def _brakes(
    velocity: Array, acceleration: Array, speed: Array, style: FlightStyle
) -> list[tuple[float, float]]:
    """By how much the squares may fall in a step: a constant, and a share of the square."""
    along = np.sum(velocity * acceleration, axis=1) / np.maximum(speed, 1e-6)
    most = np.maximum(style.acceleration_m_s2, np.abs(along))
    scale = 2.0 * STEP_S / np.maximum(speed, _SLOW_M_S)
    return list(zip((scale * most).tolist(), (scale * along).tolist(), strict=True))


def _passes(
    most: list[float],
    rows: list[list[tuple[float, float, float, float]]],
    gains: list[float],
    brakes: list[tuple[float, float]],
) -> list[float]:
    """Forward as fast as commands allow, back as late as brakes do, which hold from the start too."""
    square = 1.0
    squares = [square]
    for i in range(1, len(most)):
        root, rise = sqrt(square), gains[i - 1]
        for row in rows:
            size, added, rate, command_m_s = row[i - 1]
            if rate < inf:
                rise = min(rise, rate * (command_m_s - size * root - added * square))
        square = max(min(square + STEP_S * rise, most[i]), _LEAST)
        squares.append(square)
    for i in range(len(squares) - 2, -1, -1):
        constant, share = brakes[i]
        squares[i] = min(squares[i], squares[i + 1] + constant + share * squares[i + 1])
    squares[0] = 1.0
    for i in range(len(squares) - 1):
        constant, share = brakes[i]
        squares[i + 1] = max(squares[i + 1], squares[i] - constant - share * squares[i])
    return squares
