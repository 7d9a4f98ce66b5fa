"""While a measurement is missing, the estimator knows less and less; when it returns, all fits again."""

from math import isfinite, radians

import pytest

from firmware_py.estimation.error_state import ATTITUDE, POSITION
from tests.firmware_py.estimation.passenger import DOWN, HEADING, NORTH, NORTHWARD, Passenger

MISSING_S = 10
GROUND, PRESSURE = "ground", "barometer"  # slow errors of the sensor itself

CASES = [
    ("mocap", "external_pose", (NORTH, NORTHWARD, HEADING), False),
    ("outdoor", "gps", (NORTH, NORTHWARD), False),
    ("flow", "optical_flow", (NORTH, NORTHWARD), False),
    ("outdoor", "magnetometer", (HEADING,), False),
    ("outdoor", "barometer", (PRESSURE,), False),
    ("flow", "barometer", (PRESSURE,), False),
    ("outdoor", "range_finder", (GROUND,), True),
    ("mocap", "range_finder", (GROUND,), True),
]


@pytest.mark.parametrize(("suite", "missing", "states", "moving"), CASES)
def test_the_variance_grows_until_the_measurement_returns(suite, missing, states, moving):
    flight = Passenger(suite, seed=4, moving=True)
    flight.run(15.0)  # biases and hard iron are known then
    flight.moving = moving
    flight.run(3.0)
    layout = flight.estimator.aiding.target.layout
    indices = [getattr(layout, state) if isinstance(state, str) else state for state in states]
    known = [flight.sigma(index) for index in indices]
    flight.dropped = {missing}
    flight.run(1.0)
    before = [flight.sigma(index) for index in indices]
    for _ in range(MISSING_S - 1):
        flight.run(1.0)
        now = [flight.sigma(index) for index in indices]
        assert all(new > old for new, old in zip(now, before, strict=True))
        before = now
    sigmas = [flight.sigma(index) for index in range(9)]
    error = flight.error()
    assert all(abs(value) < 4.0 * sigma for value, sigma in zip(error, sigmas, strict=True))

    flight.dropped = set()
    off_m, resets = flight.distance_m(), flight.estimator.report().resets
    for _ in range(250):
        flight.run(0.004)
        jump_m, off_m = abs(flight.distance_m() - off_m), flight.distance_m()
        assert jump_m < 4.0 * sum(sigma**2 for sigma in sigmas[POSITION:]) ** 0.5
    assert flight.estimator.report().resets == resets  # what returned has passed its gate
    flight.run(4.0)
    for old, index in zip(known, indices, strict=True):
        assert flight.sigma(index) < max(1.5 * old, 0.9 * before[indices.index(index)])
    assert all(abs(value) < 4.0 * flight.sigma(index) for index, value in enumerate(flight.error()))


@pytest.mark.parametrize(("suite", "missing"), [("mocap", "external_pose"), ("outdoor", "gps")])
@pytest.mark.parametrize("moving", [False, True])
def test_without_a_position_for_half_a_minute_attitude_and_height_stay_good(suite, missing, moving):
    flight = Passenger(suite, seed=5, moving=moving)
    flight.dropped = {missing}
    assert flight.estimator.has_position
    flight.run(5.5)
    assert not flight.estimator.has_position
    for _ in range(49):
        flight.run(0.5)
        error, report = flight.error(), flight.estimator.report()
        assert all(map(isfinite, error))
        assert max(map(abs, error[ATTITUDE : ATTITUDE + 2])) < radians(3.0)
        assert abs(error[5]) < 0.1  # vertical velocity, m/s
        assert abs(error[DOWN]) < 0.3
        assert report.has_attitude
        assert report.has_height
        assert not report.has_position
    assert flight.sigma(NORTH) > 1.0
    assert abs(error[NORTH]) < 4.0 * flight.sigma(NORTH)
    assert abs(error[HEADING]) < radians(5.0)
