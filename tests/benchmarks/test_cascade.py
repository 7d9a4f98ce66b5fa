"""The controller that the comparison lends to MuJoCo: it must fly, or the comparison is unfair."""

import pytest

from benchmarks.peers.cascade import GRAVITY_M_S2, Cascade, clamp

MASS_KG = 0.3
STILL = [0.0] * 6
LEVEL = [1.0, 0.0, 0.0, 0.0]
GOAL = (1.0, 2.0, 3.0)


@pytest.fixture
def cascade():
    return Cascade(MASS_KG, (0.001, 0.001, 0.002), 0.075, 0.034, 10.8)


def test_at_the_goal_the_rotors_carry_the_weight_in_equal_parts(cascade):
    thrusts = cascade.step([*GOAL, *LEVEL], STILL, GOAL, 0.0)
    assert thrusts == pytest.approx([MASS_KG * GRAVITY_M_S2 / 4] * 4)


@pytest.mark.parametrize(
    ("offset", "stronger"),
    [
        ((-1.0, 0.0, 0.0), (1, 3)),  # too far back: the rear rotors pitch it forward
        ((0.0, -1.0, 0.0), (0, 3)),  # too far right: the right rotors roll it to the left
    ],
)
def test_it_leans_towards_the_goal(cascade, offset, stronger):
    position = [at + by for at, by in zip(GOAL, offset, strict=True)]
    thrusts = cascade.step([*position, *LEVEL], STILL, GOAL, 0.0)
    weaker = [thrusts[i] for i in range(4) if i not in stronger]
    assert min(thrusts[i] for i in stronger) > max(weaker)


def test_it_climbs_and_turns_to_the_goal(cascade):
    hover = MASS_KG * GRAVITY_M_S2
    assert sum(cascade.step([1.0, 2.0, 2.0, *LEVEL], STILL, GOAL, 0.0)) > hover
    front_right, rear_left, front_left, rear_right = cascade.step([*GOAL, *LEVEL], STILL, GOAL, 1.0)
    assert front_right + rear_left > front_left + rear_right


def test_it_turns_the_short_way(cascade):
    half_turn_less = [*GOAL, 0.0, 0.0, 0.0, 1.0]  # heading pi
    thrusts = cascade.step(half_turn_less, STILL, GOAL, -3.0)
    assert thrusts[0] + thrusts[1] > thrusts[2] + thrusts[3]


def test_thrusts_stay_within_what_a_rotor_can(cascade):
    thrusts = cascade.step([9.0, -9.0, -9.0, 0.7, 0.7, 0.0, 0.0], [5.0] * 6, GOAL, 2.0)
    assert all(0.0 <= thrust <= 10.8 for thrust in thrusts)


def test_clamp():
    assert [clamp(value, 1.5) for value in (-2.0, 0.3, 9.0)] == [-1.5, 0.3, 1.5]
