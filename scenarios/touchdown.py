"""Contact with the ground: crashes during a try, and where the drone lands."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import Literal

from framerunner.geometry.vectors import Quaternion, Vec3
from scenarios.models import Scenario, TrueState, ground_height, is_over_base

HARD_HIT_M_S = 2.0  # a fall of 0.2 m; cutting the motors just above the base gives little over 1 m/s
UPSIDE_DOWN_US = 500_000
LYING_US = 5_000_000  # longer than an autopilot takes to disarm after a landing
RESTING_M_S = 0.05
TOUCHING_M = 0.02  # how near the ground counts as touching when no contacts are reported
TIPPED_OVER = 0.5  # cosine of the tilt at rest: more than 60 degrees
STANDING_TOLERANCE_M = 0.3  # accepted height error of a real drone that stands

Surface = Literal["base", "floor"]


@dataclass(frozen=True, slots=True)
class Landing:
    """Where the drone came to rest."""

    surface: Surface  # what it stands on
    error_m: float  # plan distance of its centre from the base's centre


def up_component(attitude: Quaternion) -> float:
    """Cosine of the tilt: the vertical part of the body's up axis; negative when upside-down."""
    _, x, y, _ = attitude
    return 1.0 - 2.0 * (x * x + y * y)


def is_resting(velocity_m_s: Vec3) -> bool:
    """Whether a velocity is zero but for noise."""
    vx, vy, vz = velocity_m_s
    return vx * vx + vy * vy + vz * vz < RESTING_M_S * RESTING_M_S


def find_landing(
    scenario: Scenario, envelope_m: Vec3, position_m: Vec3, floor_m: float = 0.0
) -> Landing | None:
    """Find what a drone at rest stands on, by its position alone, so that it works for a real drone too.

    It stands on the base when its centre is over the base's square and not high above its top. A height below
    the top counts too: the base is solid, so it is an error of the estimate, or the floor used instead of a
    base is soft. In all challenge scenarios the base's centre is the start as well.

    Args:
        scenario: what is flown.
        envelope_m: length, width and height of the drone.
        position_m: of its centre, arena axes, shape (3,).
        floor_m: height of the floor, arena axes; see `Referee`.

    Returns:
        None when it is too high above base and floor.
    """
    x_m, y_m, z_m = position_m
    base = scenario.base
    underside_m = z_m - envelope_m[2] / 2
    error_m = hypot(x_m - base.x_m, y_m - base.y_m)
    if is_over_base(base, x_m, y_m) and underside_m < base.top_m + STANDING_TOLERANCE_M:
        return Landing("base", error_m)
    if underside_m < floor_m + STANDING_TOLERANCE_M:
        return Landing("floor", error_m)
    return None


class CrashWatch:
    """Detects a crash during one try.

    A crash is one of:
    - hitting the floor or the base at more than 2 m/s downward (hitting a gate is a contact, no crash);
    - half a second upside-down;
    - after take-off, lying still on the floor for 5 s with the motors on, away from the base;
    - what the simulation says of it (`TrueState.crash`).

    The surface touched is taken from `TrueState.contacts` or, when these are empty as for a real drone, from
    being within 2 cm of the ground.
    """

    def __init__(self, scenario: Scenario, envelope_m: Vec3, floor_m: float = 0.0) -> None:
        self._scenario = scenario
        self._envelope_m = envelope_m
        self._floor_m = floor_m
        self._near_m = scenario.base.top_m + envelope_m[2] / 2 + TOUCHING_M
        self._touched = True  # a try begins on the ground: that is no impact
        self._sinking_m_s = 0.0
        self._inverted_since_us: int | None = None
        self._lying_since_us: int | None = None

    def follow(self, state: TrueState, taken_off: bool) -> str | None:
        """Take the next state.

        Returns:
            What happened, as the predicate to "the drone", if it crashed now; else None.
        """
        if state.crash:
            return state.crash
        sinking_before_m_s, self._sinking_m_s = self._sinking_m_s, -state.velocity_arena_m_s[2]
        _, x, y, _ = state.attitude_arena
        if x * x + y * y > 0.5:  # the body's up axis points down, see `up_component`
            if self._inverted_since_us is None:
                self._inverted_since_us = state.time_us
            if state.time_us - self._inverted_since_us >= UPSIDE_DOWN_US:
                return "was upside-down for 0.5 s"
        else:
            self._inverted_since_us = None
        high = state.position_arena_m[2] > self._near_m and not state.contacts
        surface = None if high else self._touching(state)
        if surface is None:
            self._touched = False
            self._lying_since_us = None
            return None
        impact_m_s = max(sinking_before_m_s, self._sinking_m_s)
        if not self._touched and impact_m_s > HARD_HIT_M_S:
            return f"hit the {surface} at {impact_m_s:.1f} m/s"
        self._touched = True
        if taken_off and surface == "floor" and self._is_lying(state):
            return "lay on the floor for 5 s with its motors on"
        return None

    def _is_lying(self, state: TrueState) -> bool:
        if not (state.motors_on and is_resting(state.velocity_arena_m_s)):
            self._lying_since_us = None
            return False
        if self._lying_since_us is None:
            self._lying_since_us = state.time_us
        return state.time_us - self._lying_since_us >= LYING_US

    def _touching(self, state: TrueState) -> Surface | None:
        if "base" in state.contacts:
            return "base"
        if "floor" in state.contacts:
            return "floor"
        x_m, y_m, z_m = state.position_arena_m
        underside_m = z_m - self._envelope_m[2] / 2
        if underside_m > ground_height(self._scenario, x_m, y_m, self._floor_m) + TOUCHING_M:
            return None
        return "base" if is_over_base(self._scenario.base, x_m, y_m) else "floor"
