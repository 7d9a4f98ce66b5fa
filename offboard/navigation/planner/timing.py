"""Makes one path of legs: smooths accelerations, turns the heading, and slows down where a limit needs it.

A path planned in one time is flown in another: at each place as fast as speeds, accelerations and commands
allow. The square of the ratio of the speeds has bounds for its slope, which the real acceleration along the
path depends on (as in Bobrow, Dubowsky, Gibson, "Time-optimal control of robotic manipulators along specified
paths", 1985): one pass forward, one back.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot, inf, isfinite, isnan, nan, pi, remainder, sqrt

import numpy as np
import numpy.typing as npt

from offboard.limits import clamped
from offboard.navigation.goals import PRESENT_SHARE, FlightStyle, Goal, Motion, PathGate
from offboard.navigation.path import Crossing, Path
from offboard.navigation.planner.legs import Array, Leg

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


COURSE_M_S = 0.3  # slower, the drone need not see where it flies
HOLD_BEFORE_M = 0.28  # before an opening the heading is its normal; smoothing makes it later
LEFT_M = 0.25  # so far behind an opening the drone has left it: nothing of its box is between the bars
HOLD_BEHIND_M = -0.1  # before the end of the straight flight behind an opening the heading stays
_REVERSAL_RAD = 2.6  # a turn larger than this continues the way it turns already


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """A leg and what it leads to.

    Attributes:
        leg: the motion.
        goal: the goal at its end, or the gate that it leads through.
        crosses: it is the straight flight through the gate's opening.
        yaw_rad: the heading at its end; NaN if it is free.
        look: the gate to look at on the way; None for the heading of the leg's axes.
    """

    leg: Leg
    goal: Goal | None
    crosses: bool
    yaw_rad: float
    look: PathGate | None


@dataclass(slots=True, eq=False)
class Samples:
    """A path sampled every STEP_S, before it is slowed down.

    Attributes:
        times_s: shape (n,); from minus half the smoothing time on.
        positions_m: shape (n, 3).
        velocities_m_s: shape (n, 3).
        accelerations_m_s2: shape (n, 3).
        stretches: index of the stretch, shape (n,).
        begins_s: when each stretch begins.
    """

    times_s: npt.NDArray[np.floating]
    positions_m: Array
    velocities_m_s: Array
    accelerations_m_s2: Array
    stretches: npt.NDArray[np.intp]
    begins_s: list[float]


def window(smoothing_s: float) -> tuple[Array, int]:
    """Weights of a moving average, trapezoidal over a time, and half its length in steps."""
    half = max(round(smoothing_s / STEP_S / 2), 1)
    weights = np.ones(2 * half + 1)
    weights[0] = weights[-1] = 0.5
    return weights / weights.sum(), half


def run_in(start: Motion, style: FlightStyle) -> tuple[Array, Array]:
    """Position and velocity from which legs must start so that the smoothed path starts with a motion."""
    weights, half = window(style.smoothing_s)
    half_s = half * STEP_S
    spread = float(weights @ (np.arange(-half, half + 1) * STEP_S) ** 2)
    acceleration = np.array(start.acceleration_m_s2)
    velocity = np.array(start.velocity_m_s) + acceleration * half_s
    position = np.array(start.position_m) + velocity * half_s - 0.5 * acceleration * (half_s**2 + spread)
    return position, velocity


def sample(stretches: list[Stretch], start: Motion, style: FlightStyle) -> Samples:
    """The motion of stretches, smoothed: a moving average keeps the limits, which are convex."""
    weights, half = window(style.smoothing_s)
    begins = [0.0]
    for stretch in stretches:
        begins.append(begins[-1] + stretch.leg.duration_s)
    count = int(np.ceil(begins[-1] / STEP_S)) + 2 * half + 1
    raw_s = np.arange(-2 * half, count) * STEP_S  # to count - 1; smoothed: from -half
    index = np.clip(np.searchsorted(begins, raw_s, side="right") - 1, 0, len(stretches) - 1)
    position, velocity, acceleration = (np.empty((len(raw_s), 3)) for _ in range(3))
    for number, stretch in enumerate(stretches):
        rows = index == number
        inside = np.minimum(raw_s[rows] - begins[number], stretch.leg.duration_s)
        position[rows], velocity[rows], acceleration[rows] = stretch.leg.at(np.maximum(inside, 0.0))
    before = raw_s < 0.0
    past = raw_s[before][:, None]
    first, speed = run_in(start, style)
    rate = np.array(start.acceleration_m_s2)
    position[before] = first + (speed + 0.5 * rate * past) * past
    velocity[before] = speed + rate * past
    acceleration[before] = rate
    ended = raw_s >= begins[-1]
    velocity[ended] = acceleration[ended] = 0.0
    kept = slice(half, len(raw_s) - half)
    return Samples(
        raw_s[kept],
        _average(position, weights),
        _average(velocity, weights),
        _average(acceleration, weights),
        index[kept],
        begins,
    )


def _average(values: Array, weights: Array) -> Array:
    n = len(values) - len(weights) + 1
    total = np.zeros((n, *values.shape[1:]))
    for i, weight in enumerate(weights.tolist()):
        total += weight * values[i : i + n]
    return total


def headings(
    samples: Samples, stretches: list[Stretch], start: Motion, style: FlightStyle
) -> tuple[Array, Array]:
    """Continuous heading and its rate at each sample: towards what is looked at, in time for each gate."""
    weights, half = window(style.turn_smoothing_s)
    wanted, holds = _wanted_headings(samples, stretches, style)
    step = style.yaw_rate_rad_s * STEP_S
    raw = _run_in_headings(start, weights)
    yaw, turn = raw[-1], raw[-1] - raw[-2]
    hold = 0
    for i in range(half, len(wanted)):
        while hold < len(holds) and i > holds[hold][1] + half:
            hold += 1
        turn = _turn(yaw, wanted[i], turn, step)
        if hold < len(holds):
            begin, _, angle = holds[hold]
            spare = max(begin - i - half, 0) * step
            if abs(remainder(yaw + turn - angle, 2 * pi)) > spare:
                turn = min(max(remainder(angle - yaw, 2 * pi), -step), step)
        yaw += turn
        raw.append(yaw)
    raw += [yaw] * half
    smooth = _average(np.array(raw)[:, None], weights)[:, 0]
    rates = np.gradient(smooth, STEP_S)
    rates[0], smooth[0] = start.yaw_rate_rad_s, start.yaw_rad
    return smooth, rates


def _run_in_headings(start: Motion, weights: Array) -> list[float]:
    """Headings at the steps before and after the start for which the smoothed ones start with a motion."""
    half = len(weights) // 2
    times = np.arange(-half, half) * STEP_S
    rate, change = start.yaw_rate_rad_s, start.yaw_acceleration_rad_s2
    spread = float(weights @ (np.arange(-half, half + 1) * STEP_S) ** 2)
    headings: list[float] = (start.yaw_rad + rate * times + 0.5 * change * (times**2 - spread)).tolist()
    return headings


def _turn(yaw: float, wanted: float, last: float, most: float) -> float:
    """The turn of one step towards a heading (NaN for any); about half a turn continues the way it turns."""
    if isnan(wanted):
        return 0.0
    turn = remainder(wanted - yaw, 2 * pi)
    if abs(turn) > _REVERSAL_RAD and turn * last < 0.0:
        turn = -turn
    return min(max(turn, -most), most)


def _wanted_headings(
    samples: Samples, stretches: list[Stretch], style: FlightStyle
) -> tuple[list[float], list[tuple[int, int, float]]]:
    """The heading to turn to at each sample (NaN for any); where each gate's is kept: first, last, angle."""
    wanted: list[float] = []
    motions = zip(samples.positions_m.tolist(), samples.velocities_m_s.tolist(), strict=True)
    # Plain numbers, once for each stretch: the heading of its axes, and where to look.
    axes = [atan2(stretch.leg.turn[1], stretch.leg.turn[0]) for stretch in stretches]
    for ((x, y, _), (vx, vy, _)), number in zip(motions, samples.stretches.tolist(), strict=True):
        stretch, heading = stretches[number], axes[number]
        if stretch.crosses:
            wanted.append(stretch.yaw_rad)
            continue
        if (look := stretch.look) is None:
            wanted.append(heading if isnan(stretch.yaw_rad) else stretch.yaw_rad)
            continue
        dx, dy = look.centre_m[0] - x, look.centre_m[1] - y
        away = hypot(dx, dy)
        bearing = atan2(dy, dx)
        if hypot(vx, vy) > COURSE_M_S:
            course = atan2(vy, vx)
            heading = course + clamped(
                remainder(heading - course, 2 * pi), style.course_offset_rad, style.course_offset_rad
            )
        limit = style.look_limit_rad(away, look.shape)
        if limit > 0.0:
            bearing += clamped(remainder(heading - bearing, 2 * pi), limit, limit)
        wanted.append(bearing)
    holds: list[tuple[int, int, float]] = []
    for number, stretch in enumerate(stretches):
        if stretch.crosses and isinstance(stretch.goal, PathGate):
            past = (samples.positions_m - np.array(stretch.goal.centre_m))[:, :2] @ np.array(
                [np.cos(stretch.yaw_rad), np.sin(stretch.yaw_rad)]
            )
            near = (past > -HOLD_BEFORE_M) & (past < style.straight_after_m + HOLD_BEHIND_M)
            inside = np.flatnonzero((samples.stretches == number) & near)
            if len(inside):
                holds.append((int(inside[0]), int(inside[-1]), stretch.yaw_rad))
                for i in range(int(inside[-1]) + 1, len(wanted)):
                    if samples.stretches[i] != number:
                        break
                    wanted[i] = nan
    if not (isnan(stretches[-1].yaw_rad) or stretches[-1].crosses):
        last = len(wanted) - 1
        end = max(int((samples.begins_s[-1] - samples.times_s[0]) / STEP_S), 0)
        holds.append((min(end, last), last, stretches[-1].yaw_rad))
    return wanted, holds


def slowed(
    samples: Samples, yaw: Array, yaw_rate: Array, stretches: list[Stretch], style: FlightStyle
) -> Path:
    """The path, with time stretched where the speed along an axis would be too high."""
    squares = speed_squares(
        samples.velocities_m_s,
        samples.accelerations_m_s2,
        yaw,
        yaw_rate,
        near_bars=_near_bars(samples, stretches),
        style=style,
    )
    share = np.sqrt(squares)
    steps = STEP_S / (0.5 * (share[:-1] + share[1:]))
    times = np.concatenate(([0.0], np.cumsum(steps)))
    change = np.gradient(squares, STEP_S) / 2 if len(squares) > 1 else np.zeros_like(squares)
    change[0] = 0.0
    velocities = samples.velocities_m_s * share[:, None]
    accelerations = samples.accelerations_m_s2 * squares[:, None] + samples.velocities_m_s * change[:, None]
    knots = np.column_stack((samples.positions_m, velocities, accelerations, yaw, yaw_rate * share))
    crossings = _crossings(samples, stretches, times)
    return Path(times.tolist(), knots.tolist(), crossings)


def _near_bars(samples: Samples, stretches: list[Stretch]) -> npt.NDArray[np.bool_]:
    """At which samples the drone's box is about to be between an opening's bars, or is still there."""
    near = np.zeros(len(samples.times_s), dtype=bool)
    for number, stretch in enumerate(stretches):
        if stretch.crosses and isinstance(stretch.goal, PathGate):
            away = np.hypot(*(samples.positions_m - np.array(stretch.goal.centre_m))[:, :2].T)
            near |= (np.abs(samples.stretches - number) <= 1) & (away < LEFT_M)
    return near


def _crossings(samples: Samples, stretches: list[Stretch], times: Array) -> tuple[Crossing, ...]:
    """When the path crosses its gates."""
    crossings: list[Crossing] = []
    for number, stretch in enumerate(stretches):
        if not stretch.crosses or not isinstance(stretch.goal, PathGate):
            continue
        rows = np.flatnonzero(samples.stretches >= number)
        normal = np.array([np.cos(stretch.yaw_rad), np.sin(stretch.yaw_rad)])
        past = (samples.positions_m[rows, :2] - np.array(stretch.goal.centre_m)[:2]) @ normal
        behind = int(np.argmax(past >= 0.0))
        time_s = (
            float(times[rows[0]])
            if behind == 0
            else float(np.interp(0.0, past[behind - 1 : behind + 1], times[rows[behind - 1 : behind + 1]]))
        )
        crossings.append(Crossing(stretch.goal, stretch.yaw_rad, time_s))
    return tuple(crossings)
