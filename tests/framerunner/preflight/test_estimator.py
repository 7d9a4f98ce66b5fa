"""What the checks before arming make of the reports of PX4's and ArduPilot's estimators."""

from types import SimpleNamespace

import pytest

from framerunner.preflight.estimator import estimator_facts, has_global_position
from offboard.safety.check import Outcome
from offboard.safety.vehicle_checks import estimator_check

ALL = 1 | 2 | 4 | 8 | 16 | 32  # EKF_STATUS_FLAGS: attitude, velocities, positions, height


def record(flags=ALL, origin=True, **variances):
    names = ("velocity_variance", "pos_horiz_variance", "pos_vert_variance", "compass_variance")
    report = SimpleNamespace(flags=flags, **(dict.fromkeys(names, 0.1) | variances))
    latest = {"EKF_STATUS_REPORT": report} | ({"GPS_GLOBAL_ORIGIN": object()} if origin else {})
    return SimpleNamespace(latest=latest)


@pytest.mark.parametrize(
    ("found", "outcome", "words"),
    [
        (record(), Outcome.PASS, "largest ratio of an innovation 0.10"),
        (record(pos_horiz_variance=0.7), Outcome.FAIL, "largest ratio of an innovation 0.70"),
        (record(flags=ALL & ~(8 | 16)), Outcome.FAIL, "it does not know its position"),
        (record(flags=2), Outcome.FAIL, "it does not know its attitude and position and height"),
        (SimpleNamespace(latest={}), Outcome.FAIL, "no EKF_STATUS_REPORT is received"),
    ],
)
def test_ardupilots_report_is_judged(found, outcome, words):
    check = estimator_check(estimator_facts(found, "ardupilot"))
    assert (check.outcome, check.value) == (outcome, words)


def test_ardupilots_fence_needs_a_position_and_the_estimators_origin():
    assert has_global_position(record(), "ardupilot")
    assert not has_global_position(record(origin=False), "ardupilot")
    assert not has_global_position(record(flags=ALL & ~16), "ardupilot")
    assert not has_global_position(record(), "px4")
