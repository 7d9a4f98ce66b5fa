"""Suites: files and their faults, independence of sensors, repeatability."""

from dataclasses import fields
from pathlib import Path

import pytest

from framerunner.vehicle.measurements import Readings
from sitl.sensors.suite import SUITE_FILES, SensorSuite, SuiteError, load_suite
from tests.sitl.sensors.statistics import AIRFRAME, ORIGIN, TICK_US, motion

ALL = load_suite("outdoor").model_copy(
    update={
        "gps": load_suite("outdoor").gps.model_copy(update={"first_fix_s": 0.0}),
        "external_pose": load_suite("mocap").external_pose,
        "optical_flow": load_suite("flow").optical_flow,
    }
)
SENSORS = ("magnetometer", "barometer", "gps", "range_finder", "optical_flow", "external_pose", "battery")
SPEEDS = (AIRFRAME.hover_speed_rad_s,) * 4


def recorded(spec, seed, ticks=400):
    """What every sensor delivers, as text: NaN differs from itself."""
    suite = SensorSuite(spec, AIRFRAME, ORIGIN, seed)
    found = {field.name: [] for field in fields(Readings)} | {"external_pose": []}
    for tick in range(ticks):
        readings, pose = suite.read(motion(tick * TICK_US, motor_speeds_rad_s=SPEEDS), 16.0, 5.0)
        for field in fields(Readings):
            found[field.name].append(repr(getattr(readings, field.name)))
        found["external_pose"].append(repr(pose))
    return found


def values_of(name):
    return ("battery_voltage_v", "battery_current_a") if name == "battery" else (name,)


def test_the_installed_suites_have_their_sensors():
    sensors = {
        name: {each for each in ("imu", *SENSORS) if getattr(load_suite(name), each) is not None}
        for name in SUITE_FILES.names()
    }
    common = {"imu", "barometer", "range_finder", "battery"}
    assert sensors == {
        "ideal": set(),
        "mocap": common | {"external_pose"},
        "external": common | {"external_pose"},
        "vio": common | {"external_pose"},
        "outdoor": common | {"magnetometer", "gps"},
        "flow": common | {"magnetometer", "optical_flow"},
        "flow-cheap": common | {"magnetometer", "optical_flow"},
    }
    assert load_suite("ideal").ideal
    assert not load_suite("mocap").ideal


def test_the_same_seed_gives_the_same_bits_and_another_seed_others():
    first = recorded(ALL, 1)
    assert recorded(ALL, 1) == first
    other = recorded(ALL, 2)
    for name in ("imu", *SENSORS):
        for value in values_of(name):
            assert set(first[value]) & set(other[value]) <= {"None"}, value


@pytest.mark.parametrize("name", SENSORS)
def test_a_sensor_that_is_left_out_changes_no_other(name):
    everything = recorded(ALL, 1)
    without = recorded(ALL.model_copy(update={name: None}), 1)
    for value, found in everything.items():
        if value in values_of(name):
            assert without[value] != found
        else:
            assert without[value] == found


def test_each_sensor_has_its_rate():
    counts = {
        name: sum(each != "None" for each in found) for name, found in recorded(ALL, 1, ticks=1000).items()
    }
    assert counts["imu"] == 1000
    assert counts["magnetometer"] == counts["range_finder"] == counts["optical_flow"] == 200
    assert (counts["barometer"], counts["gps"], counts["external_pose"]) == (100, 32, 199)


def test_an_external_pose_is_given_in_one_tick_only():
    suite = SensorSuite(load_suite("mocap"), AIRFRAME, ORIGIN, 1)
    poses = [suite.read(motion(tick * TICK_US), 16.0, 5.0)[1] for tick in range(20)]
    assert [index for index, pose in enumerate(poses) if pose] == [8, 13, 18]


def test_without_a_monitor_the_batterys_values_are_exact_and_with_one_near():
    ideal, _ = SensorSuite(load_suite("ideal"), AIRFRAME, ORIGIN, 1).read(motion(), 16.0, 5.0)
    assert ideal == Readings(0, battery_voltage_v=16.0, battery_current_a=5.0)
    measured, _ = SensorSuite(ALL, AIRFRAME, ORIGIN, 1).read(motion(), 16.0, 0.0)
    assert measured.battery_voltage_v != 16.0
    assert measured.battery_voltage_v == pytest.approx(16.0, abs=0.7)
    assert measured.battery_current_a >= 0.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("name: mine\n", "imu missing: every autopilot needs one; add it, or `ideal: true`"),
        ("name: mine\nideal: true\nbatery: {}\n", ":3: batery is not a known field; did you mean battery?"),
        (
            "name: mine\nideal: true\nbattery: {voltage_noise_v: 1, current_noise_a: -1, scale_error: 0}\n",
            ":3: battery.current_noise_a is -1: must be at least 0",
        ),
        (
            "name: mine\nideal: true\nbattery: {voltage_noise_v: 1, current_noise_a: 1, scale_error: 0}\n",
            ":2: ideal true has no models; remove battery, or ideal",
        ),
        (
            "name: mine\nrange_finder: {rate_hz: 5, noise_m: 0, offset_m: 0, min_distance_m: 2,"
            " max_distance_m: 1}\n",
            ":2: range_finder.min_distance_m 2.0 must be below max_distance_m 1.0",
        ),
        ("name: mine\nimu: {gyroscope: 1}\n", "imu.gyroscope"),
        ("name: mine\nbarometer: {rate_hz: fast}\n", ':2: barometer.rate_hz is "fast": must be a number'),
    ],
)
def test_a_bad_file_is_refused_in_one_line_that_names_the_field(tmp_path, monkeypatch, text, words):
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text(text)
    with pytest.raises(SuiteError) as caught:
        load_suite("mine.yaml")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("mine.yaml:")


def test_an_unknown_name_is_refused_with_the_one_that_was_meant():
    with pytest.raises(
        SuiteError, match=r'unknown suite "outdor"; did you mean outdoor\? Known: external, flow'
    ):
        load_suite("outdor")


def test_an_own_file_can_be_loaded(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("name: mine\nideal: true\n")
    assert load_suite(str(path)).name == "mine"


def test_the_suite_of_the_documentation_can_be_loaded(tmp_path):
    text = (Path(__file__).parents[3] / "docs" / "sensors.md").read_text(encoding="utf-8")
    path = tmp_path / "mine.yaml"
    path.write_text(text.partition("```yaml\n")[2].partition("```")[0])
    assert load_suite(path).range_finder.max_distance_m == 12.0
