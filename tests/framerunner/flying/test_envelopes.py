"""No flight within its class's limits exceeds the envelope from which the bound is computed.

Flown here: the command sequences that a search found to exceed the commanded speeds most (in plan, upwards,
downwards, over four legs, and after motors off), and random ones. All axes at their limits at once, reversed
at the worst moments, is what no mission does.
"""

from dataclasses import dataclass
from itertools import product
from math import floor, hypot
from random import Random

import numpy as np
import pytest

from firmware_py.offboard_requests import setpoint_from_body_velocity
from firmware_py.status import FlightMode
from framerunner.flying.envelopes import ENVELOPES
from framerunner.flying.plan import airframe_limits
from offboard.drone import VelocityFluCommand
from offboard.limits import CONTEST
from scenarios.models import Arena, Base, Scenario
from scenarios.touchdown import HARD_HIT_M_S
from sitl.simulation import Simulation

FIELD = Scenario(
    name="field", arena=Arena(length_x_m=400, width_y_m=400, height_m=200), base=Base(edge_m=0.5, top_m=10)
)
CLIMB = ((40, 0, 0, 1, 0),)
# (ticks of 50 ms, forward, left, up, yaw rate), in multiples of the limits.
WORST = {
    "level": (
        *CLIMB,
        *((22, -1, 1, -1, 0), (12, -1, 1, 1, 0), (50, -1, 1, 1, 1), (35, 1, -1, -1, 0), (2, -1, -1, 1, 0)),
        *((10, 1, -1, 1, 0), (32, -1, -1, 1, 0), (16, -1, 1, 1, 1)),
    ),
    "level, less yaw": (*CLIMB, (32, 1, -1, 1, 0), (28, 1, 1, -1, 0), (28, -1, 1, -1, 0), (31, -1, 1, 1, 0)),
    "up": (*CLIMB, (46, 1, 1, -1, 0), (13, 1, 1, 1, -1), (52, -1, -1, 1, 0)),
    "down": (
        *(*CLIMB, (14, -1, -1, -1, -1), (58, -1, -1, -1, 0), (13, -1, -1, 1, 0), (41, -0.5, -0.6, 0.2, -1)),
        *((14, -1, -1, -1, 0), (5, -1, 1, 1, 0)),
    ),
    "four legs": (
        *((27, 1, 1, 1, -1), (9, 1, -1, 1, 1), (4, 1, -1, -1, 1), (44, 1, -1, -1, 0), (30, 1, -1, 1, 1)),
        *((23, -1, 1, 1, 0), (16, -1, 1, 1, 1), (10, 1, -1, 1, 0), (26, 1, -1, -1, 0), (14, 1, -1, 1, 0)),
        *((14, 1, -1, 1, -1), (2, 1, -1, 1, 0)),
    ),
    "four legs, faster": (
        *((32, 1, 1, 1, 0), (1, 1, 1, -1, 0), (11, -1, 1, -1, -1), (32, -1, 1, 1, 1), (4, -1, 1, 1, 0)),
        *((20, -1, -1, 1, -1), (13, -1, -1, 1, 1), (8, -1, 1, 1, 0), (23, 1, 1, -1, 0), (12, 1, -1, -1, -1)),
        (5, 1, 1, 1, -1),
    ),
    "from the start": ((45, 1, 1, 1, 0), (15, 1, 1, 1, 1), (20, 1, 1, -1, 0), (40, 1, 1, 1, 0)),
    "fall, far": (*(*CLIMB, (23, 1, -1, 1, 1), (29, 1, 1, 1, 0), (1, 0, -1, 0.7, 0), (44, 1, -1, 1, 1)),),
    "fall, deep": (
        *(*CLIMB, (14, 1, -1, 1, -1), (13, -0.75, 0.9, -0.71, 0), (4, -1, -1, 1, 0), (15, 0, -0.6, 0.2, 0)),
        *((1, 1, -1, -1, -1), (38, 1, -1, -1, 1)),
    ),
    "fall, tilted": (*CLIMB, (48, -1, 1, -1, 1), (32, 1, -1, 1, 0)),
}
STEP = 12  # control ticks of 4 ms to a command


@dataclass(frozen=True)
class Flown:
    """True states, every 4 ms, from the moment when the motors started; shape (states, 3)."""

    position_m: np.ndarray
    velocity_m_s: np.ndarray
    fall_position_m: np.ndarray  # from motors off, for two seconds
    fall_velocity_m_s: np.ndarray


def fly(segments, mission_class):
    """Command in body axes, from before the motors start until they stop in the air."""
    simulation = Simulation(FIELD)
    autopilot, airframe = simulation.autopilot, simulation.world.airframe
    limits = CONTEST if mission_class == "contest" else airframe_limits(airframe)

    def send(forward, left, up, turn):
        level = limits.limited(VelocityFluCommand(forward * limits.forward_m_s, left * limits.left_m_s))
        up *= limits.up_m_s if up > 0 else limits.down_m_s
        state = autopilot.state
        velocity = (level.forward_m_s, -level.left_m_s, -up)
        turn_rad_s = -turn * limits.yaw_rate_rad_s
        autopilot.accept_setpoint(setpoint_from_body_velocity(velocity, turn_rad_s, state, state.time_us))

    def tick(count):
        for _ in range(count):
            simulation.tick()
            yield (*simulation.truth.position_arena_m, *simulation.truth.velocity_arena_m_s)

    while not autopilot.status.ready:
        simulation.tick()
    for _ in range(10):
        send(*segments[0][1:])
        list(tick(STEP))
    autopilot.set_mode(FlightMode.OFFBOARD)
    autopilot.arm()
    states = []
    for count, *command in segments:
        for _ in range(count):
            send(*command)
            states += tick(STEP)
    assert simulation.truth.motors_on, "it lost control, which ends a try: choose other commands"
    autopilot.disarm(force=True)
    flight, fall = np.array(states), np.array(list(tick(500)))
    return Flown(flight[:, :3], flight[:, 3:], fall[:, :3], fall[:, 3:])


def random_segments(seed):
    """Mostly full deflections, each for a random time, after a climb."""
    random = Random(seed)
    corners = list(product((-1, 1), repeat=3))
    segments = list(CLIMB) if seed % 2 else []
    while sum(count for count, *_ in segments) < 200:
        command = random.choice(corners) if random.random() < 0.8 else [random.uniform(-1, 1) for _ in "xyz"]
        segments.append((1 + floor(60 * random.random() ** 2), *command, random.choice((-1, 0, 0, 1))))
    return segments


def check(flown, envelope):
    """Compare with every part of an envelope."""
    place = flown.position_m[::STEP]
    apart_s = np.subtract.outer(np.arange(len(place)), np.arange(len(place))).T * STEP * 0.004
    moved = place[None] - place[:, None]
    level_m = np.hypot(moved[..., 0], moved[..., 1])
    later = apart_s > 0
    for reach, moved_m, speed_m_s in (
        (envelope.level, level_m, np.hypot(flown.velocity_m_s[:, 0], flown.velocity_m_s[:, 1])),
        (envelope.up, moved[..., 2], flown.velocity_m_s[:, 2]),
        (envelope.down, -moved[..., 2], -flown.velocity_m_s[:, 2]),
    ):
        assert (moved_m - reach.speed_m_s * apart_s)[later].max() <= reach.excess_m
        assert speed_m_s.max() <= reach.peak_m_s
    # The four legs that are longest together, by dynamic programming over where each ends.
    legs_m = np.where(later, level_m, -np.inf)
    longest_m = legs_m[0].copy()
    for _ in range(3):
        longest_m = np.maximum(longest_m, (longest_m[:, None] + legs_m).max(axis=0))
    assert (longest_m - envelope.level.speed_m_s * apart_s[0]).max() <= envelope.total_excess_m
    check_fall(flown, envelope.fall)


def check_fall(flown, fall):
    lost_m = flown.fall_position_m[0, 2] - flown.fall_position_m[:, 2]
    aside = flown.fall_position_m[:, :2] - flown.fall_position_m[0, :2]
    level_m = np.hypot(aside[:, 0], aside[:, 1])
    can_land = -flown.fall_velocity_m_s[:, 2] <= HARD_HIT_M_S
    assert (level_m - fall.level_m - fall.level_per_m * np.maximum(lost_m, 0))[can_land].max() <= 0
    assert level_m[can_land].max() <= fall.longest_m
    assert lost_m[can_land].max() <= fall.deepest_m
    assert lost_m.min() >= -fall.rise_m


@pytest.mark.parametrize("mission_class", ["contest", "open"])
@pytest.mark.parametrize("name", WORST)
def test_worst_commands_found_stay_within_the_envelope(name, mission_class):
    check(fly(WORST[name], mission_class), ENVELOPES["abejorro", mission_class])


@pytest.mark.parametrize("mission_class", ["contest", "open"])
@pytest.mark.parametrize("seed", range(4))
def test_random_full_deflections_stay_within_the_envelope(seed, mission_class):
    check(fly(random_segments(seed), mission_class), ENVELOPES["abejorro", mission_class])


def test_envelope_is_no_wider_than_flown():
    """The excess in plan is at most half as much again as the worst commands reach."""
    envelope = ENVELOPES["abejorro", "contest"]
    flown = fly(WORST["level"], "contest")
    place, steps = flown.position_m[::STEP], np.arange(len(flown.position_m[::STEP]))
    moved = place[None] - place[:, None]
    apart_s = (steps[None] - steps[:, None]) * STEP * 0.004
    excess_m = (np.hypot(moved[..., 0], moved[..., 1]) - envelope.level.speed_m_s * apart_s)[
        apart_s > 0
    ].max()
    assert excess_m > envelope.level.excess_m / 1.5
    assert hypot(*flown.velocity_m_s[:, :2].T.max(axis=1)) > envelope.level.speed_m_s
