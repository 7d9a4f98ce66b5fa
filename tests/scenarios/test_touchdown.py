import pytest

from scenarios.models import Base, Scenario, StartPose, TrueState
from scenarios.touchdown import CrashWatch, find_landing, is_resting, up_component

ENVELOPE = (0.25, 0.25, 0.045)
SCENARIO = Scenario(name="a", base=Base(x_m=1.0, y_m=0.0), start=StartPose(x_m=1.0))
LEVEL = (1.0, 0.0, 0.0, 0.0)
INVERTED = (0.0, 1.0, 0.0, 0.0)


def state(time_s, position, velocity=(0.0, 0.0, 0.0), attitude=LEVEL, motors_on=True, contacts=()):
    return TrueState(round(time_s * 1e6), position, velocity, attitude, motors_on, contacts)


def crash(states, taken_off=True):
    watch = CrashWatch(SCENARIO, ENVELOPE)
    return next((words for item in states if (words := watch.follow(item, taken_off)) is not None), None)


def test_up_component_is_the_cosine_of_the_tilt():
    assert up_component(LEVEL) == 1.0
    assert up_component(INVERTED) == -1.0
    assert up_component((0.5**0.5, 0.0, 0.5**0.5, 0.0)) == pytest.approx(0.0)
    assert is_resting((0.02, 0.02, -0.02))
    assert not is_resting((0.0, 0.0, 0.06))


@pytest.mark.parametrize(
    ("position", "surface", "error_m"),
    [
        ((1.03, 0.04, 0.53), "base", 0.05),
        ((1.0, 0.0, 0.75), "base", 0.0),  # a real drone's height is not exact
        ((1.25, 0.0, 0.53), "base", 0.25),
        ((1.26, 0.0, 0.02), "floor", 0.26),
        ((1.07, 0.0, 0.2), "base", 0.07),  # nor is a real floor hard
        ((4.0, 4.0, 0.02), "floor", 5.0),
        ((1.3, 0.0, 0.53), None, None),
        ((1.0, 0.0, 1.0), None, None),
    ],
)
def test_landing_surface_and_error(position, surface, error_m):
    landing = find_landing(SCENARIO, ENVELOPE, position)
    if surface is None:
        assert landing is None
    else:
        assert landing is not None
        assert landing.surface == surface
        assert landing.error_m == pytest.approx(error_m)


@pytest.mark.parametrize(
    ("x_m", "height_m", "surface"),
    [(1.07, 0.53, "base"), (1.07, 0.2, "base"), (1.4, 0.53, "floor"), (1.4, 0.2, "floor"), (1.4, 0.9, None)],
)
def test_landing_surface_on_a_floor_without_a_base(x_m, height_m, surface):
    landing = find_landing(SCENARIO, ENVELOPE, (x_m, 0.0, height_m), SCENARIO.base.top_m)
    assert (landing.surface if landing else None) == surface


def test_a_floor_without_a_base_is_hit_at_its_own_height():
    fall = state(0, (3, 0, 0.9), (0, 0, -2.5))
    hit = state(0.03, (3, 0, 0.54), (0, 0, 0.4))
    watch = CrashWatch(SCENARIO, ENVELOPE, SCENARIO.base.top_m)
    assert (watch.follow(fall, True), watch.follow(hit, True)) == (None, "hit the floor at 2.5 m/s")


@pytest.mark.parametrize(("contacts", "height_m"), [(("floor",), 0.05), ((), 0.03)])
def test_a_hard_hit_on_the_floor_counts_with_and_without_contacts(contacts, height_m):
    fall = state(0, (3, 0, 0.3), (0, 0, -2.5))
    hit = state(0.03, (3, 0, height_m), (0, 0, 0.4), contacts=contacts)
    assert crash([fall, hit]) == "hit the floor at 2.5 m/s"


def test_a_hard_hit_on_the_base_counts():
    states = [state(0, (1, 0, 0.8), (0, 0, -3)), state(0.03, (1, 0, 0.54), (0, 0, -3), contacts=("base",))]
    assert crash(states) == "hit the base at 3.0 m/s"


def test_cutting_the_motors_just_above_the_base_is_no_crash():
    states = [
        state(0, (1, 0, 0.6), (0, 0, 0)),
        state(0.11, (1, 0, 0.53), (0, 0, -1.15), motors_on=False, contacts=("base",)),
        state(0.13, (1, 0, 0.54), (0, 0, 0.3), motors_on=False),
    ]
    assert crash(states) is None


def test_a_try_that_begins_on_the_ground_has_no_impact():
    assert crash([state(0, (3, 0, 0.02), (0, 0, -9), contacts=("floor",))]) is None


def test_fast_descent_high_up_is_no_crash():
    assert crash([state(i / 50, (0, 0, 3.5 - i / 50), (0, 0, -5)) for i in range(50)]) is None


def test_half_a_second_upside_down_is_a_crash():
    assert crash([state(t, (0, 0, 2), attitude=INVERTED) for t in (0.0, 0.3, 0.49)]) is None
    words = crash([state(t, (0, 0, 2), attitude=INVERTED) for t in (0.0, 0.3, 0.5)])
    assert words == "was upside-down for 0.5 s"
    recovered = [(0.0, INVERTED), (0.4, LEVEL), (0.6, INVERTED), (1.0, INVERTED)]
    assert crash([state(t, (0, 0, 2), attitude=attitude) for t, attitude in recovered]) is None


def lying(seconds, position=(3, 0, 0.02), **kwargs):
    return [state(i / 10, position, **kwargs) for i in range(int(seconds * 10) + 1)]


def test_lying_on_the_floor_with_motors_on_is_a_crash_after_a_flight_only():
    assert crash(lying(5.0)) == "lay on the floor for 5 s with its motors on"
    assert crash(lying(4.9)) is None
    assert crash(lying(9.0), taken_off=False) is None
    assert crash(lying(9.0, motors_on=False)) is None
    assert crash(lying(9.0, velocity=(0.2, 0, 0))) is None
    assert crash(lying(9.0, position=(1, 0, 0.53))) is None  # waiting on the base is allowed
    assert crash([*lying(4.0), state(4.1, (3, 0, 0.5)), *lying(4.0)[1:]]) is None
