from dataclasses import replace
from math import inf, nan

import pytest

from framerunner.errors import SettingError
from framerunner.wire.session.estimator import EstimatorStatus
from offboard.safety.check import Check, Outcome, accept, check_names, failures
from offboard.safety.vehicle_checks import (
    CameraFacts,
    battery_check,
    calibration_checks,
    camera_checks,
    estimator_check,
    link_checks,
)
from vision.calibration.model import Calibration, Mounting

ESTIMATOR = EstimatorStatus(True, True, True, True, {"position": 0.1})
LINK = {"lost_share": 0.0, "round_trips_s": (0.02,) * 20, "requests": 20}
CAMERA = CameraFacts(30.0, 0.05, 0.1, assumed_age_s=0.1, assumed_by="--camera-delay", size_px=(320, 240))


def failed(*checks):
    return [check.name for check in checks if check.outcome is Outcome.FAIL]


def test_a_good_drone_passes():
    checks = [
        battery_check(80.0, 12.0),
        estimator_check(ESTIMATOR, "ESTIMATOR_STATUS"),
        *link_checks(**LINK),
        *camera_checks(CAMERA),
    ]
    assert {check.outcome for check in checks} == {Outcome.PASS}
    assert all(check.limit and not check.advice for check in checks)


@pytest.mark.parametrize("percent", [39.0, 0.0, nan])
def test_a_low_or_unknown_charge_fails(percent):
    check = battery_check(percent, nan)
    assert check.outcome is Outcome.FAIL
    assert check.advice


@pytest.mark.parametrize(
    "changed",
    [
        *({"has_attitude": False}, {"has_position": False}, {"has_height": False}),
        *({"ratios": {"position": 0.6}}, {"ratios": {"height": inf}}),
    ],
)
def test_an_estimator_that_does_not_know_fails(changed):
    assert failed(estimator_check(replace(ESTIMATOR, **changed), "ESTIMATOR_STATUS")) == ["estimator"]
    assert failed(estimator_check(None, "ESTIMATOR_STATUS")) == ["estimator"]


@pytest.mark.parametrize(
    ("changed", "names"),
    [
        ({"lost_share": 0.06}, ["link loss"]),
        ({"round_trips_s": (0.02,) * 19 + (0.3,)}, ["link latency"]),
        ({"round_trips_s": (0.02,) * 4}, ["link latency"]),
    ],
)
def test_a_bad_link_fails(changed, names):
    assert failed(*link_checks(**(LINK | changed))) == names


@pytest.mark.parametrize(
    ("changed", "names"),
    [
        ({"rate_hz": 5.0}, ["camera"]),
        ({"longest_gap_s": 0.7}, ["camera"]),
        ({"age_s": 0.4}, ["camera delay"]),
        ({"age_s": -0.01}, []),
        ({"age_s": -4.6}, ["camera delay"]),
        ({"age_s": nan, "assumed_age_s": 0.4}, ["camera delay"]),
        ({"age_s": nan}, []),
        ({"problem": "no image within 5 s"}, ["camera"]),
    ],
)
def test_a_bad_camera_fails(changed, names):
    assert failed(*camera_checks(replace(CAMERA, **changed))) == names


@pytest.mark.parametrize(
    ("by", "outcome", "words"),
    [
        ("the calibration", Outcome.PASS, "0.100 s by the calibration"),
        ("", Outcome.NOTE, "never measured; 0.1 s are assumed"),
    ],
)
def test_a_camera_delay_that_nobody_measured_is_noted(by, outcome, words):
    _, delay = camera_checks(replace(CAMERA, age_s=nan, assumed_by=by))
    assert delay.outcome is outcome
    assert delay.value.startswith(words)


def test_a_failure_is_accepted_by_name_or_all():
    checks = [Check("a", Outcome.FAIL, "x"), Check("b", Outcome.FAIL, "y"), Check("c", Outcome.PASS, "z")]
    assert [check.name for check in failures(accept(checks, ["a"]))] == ["b"]
    assert failures(accept(checks, ["all"])) == []
    assert accept(checks, ["c"])[2].outcome is Outcome.PASS


def test_a_name_that_is_no_checks_is_told_with_all_names():
    check_names(["a", "all"], ["a", "b"])
    with pytest.raises(SettingError, match="the checks are Apple, banana, and all accepts each"):
        check_names(["x"], ["banana", "Apple"])


SIZE_PX = (320, 240)


def calibrated(width_px=320, height_px=240, *, mounting=None):
    lens = Calibration.ideal(width_px, height_px, 200.0)
    return lens.model_copy(update={"made_on": "2026-11-20", "mounting": mounting})


def days_since(days):
    return lambda day: None if day is None else days


def test_a_mounting_that_was_never_measured_is_noted_and_another_size_fails():
    (none,) = calibration_checks(None, SIZE_PX, days_since(3))
    lens, unmeasured = calibration_checks(calibrated(), SIZE_PX, days_since(3))
    assert (none.outcome, lens.outcome, unmeasured.outcome) == (Outcome.NOTE, Outcome.PASS, Outcome.NOTE)
    assert "never measured" in unmeasured.value and "camera extrinsics" in unmeasured.advice
    mounting = Mounting(
        angles_frd_rad=(0.0, 0.1, 0.0), angles_std_rad=(0.001, 0.002, 0.003), measured_on="2026-11-20"
    )
    _, measured = calibration_checks(calibrated(mounting=mounting), SIZE_PX, days_since(0))
    assert measured.outcome is Outcome.PASS
    assert measured.value == "roll 0.0, pitch 5.7, yaw 0.0 degrees (1 sigma 0.06, 0.11, 0.17), measured today"
    other_size, _ = calibration_checks(calibrated(640, 480, mounting=mounting), SIZE_PX, days_since(0))
    assert failed(other_size) == ["camera calibration"]


@pytest.mark.parametrize(("days", "outcome"), [(90, Outcome.PASS), (91, Outcome.NOTE), (None, Outcome.NOTE)])
def test_an_old_calibration_is_noted(days, outcome):
    mounting = Mounting(angles_frd_rad=(0.0, 0.0, 0.0), measured_on="2026-11-20")
    checks = calibration_checks(calibrated(mounting=mounting), SIZE_PX, days_since(days))
    assert [each.outcome for each in checks] == [outcome, outcome]
