"""What the doctor says about a camera that it is given."""

from datetime import date, timedelta

from framerunner.doctor.camera_times import CameraTimes, examine_camera
from offboard.safety.check import Outcome
from vision.calibration.model import Calibration, Mounting

TIMES = CameraTimes(tuple(0.1 * number for number in range(30)), (None,) * 30, (320, 240))
TODAY = date.today()


def levels(*arguments):
    return {each.name: each.outcome for each in examine_camera(*arguments)}


def calibration(**values):
    return Calibration.ideal(320, 240, 160.0).model_copy(update={"made_on": TODAY.isoformat(), **values})


def test_all_is_known():
    mounting = Mounting(angles_frd_rad=(0.0, 0.0, 0.0), measured_on=(TODAY - timedelta(days=2)).isoformat())
    known = calibration(mounting=mounting, delay_s=0.08)
    findings = {each.name: each for each in examine_camera(TIMES, known, None)}
    assert {each.outcome for each in findings.values()} == {Outcome.PASS}
    assert findings["camera"].value.startswith("10.0 images a second of 320 × 240")
    assert findings["camera delay"].value.startswith("0.080 s by the calibration")
    assert findings["camera mounting"].value.endswith("measured 2 days ago")


def test_what_was_never_measured_is_noted():
    expected = {
        "camera": Outcome.PASS,
        "camera delay": Outcome.NOTE,
        "camera calibration": Outcome.PASS,
        "camera mounting": Outcome.NOTE,
    }
    assert levels(TIMES, calibration(), None) == expected
    assert levels(None, None, None) == {"camera calibration": Outcome.NOTE}


def test_a_camera_that_gives_nothing_or_another_size_is_missing():
    assert levels(CameraTimes(problem="gone"), None, None)["camera"] is Outcome.FAIL
    assert levels(TIMES, calibration(width_px=640), None)["camera calibration"] is Outcome.FAIL


def test_a_camera_that_gives_one_image_is_missing():
    assert levels(CameraTimes((1.0,), (None,), (320, 240)), None, None)["camera"] is Outcome.FAIL


def test_images_with_vehicle_times_have_an_age_by_the_vehicles_clock_alone():
    received_s = TIMES.received_s
    stamped = CameraTimes(received_s, tuple(round(1e6 * at_s) + 50_000 for at_s in received_s), (320, 240))
    for clock_ms, level, words in ((None, Outcome.NOTE, "not known"), ((250, 0.1), Outcome.PASS, "0.10 s")):
        findings = {each.name: each for each in examine_camera(stamped, None, clock_ms)}
        assert findings["camera delay"].outcome is level
        assert findings["camera delay"].value.startswith(words)
