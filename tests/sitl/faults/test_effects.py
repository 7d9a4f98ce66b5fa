"""What each kind of fault does to the samples of each sensor."""

from dataclasses import replace
from math import isnan, nan
from statistics import pstdev

import pytest

from framerunner.vehicle.measurements import (
    BarometerSample,
    ExternalPose,
    FixType,
    FlowSample,
    GpsSample,
    ImuSample,
    MagnetometerSample,
    RangeSample,
    Readings,
    Sensors,
)
from scenarios.faults.declaration import SIZES, Fault, FaultKind, FaultPart
from sitl.faults.sensors import SensorFaults

LEVEL = (1.0, 0.0, 0.0, 0.0)
FIELDS = {
    FaultPart.MAGNETOMETER: "magnetometer",
    FaultPart.BAROMETER: "barometer",
    FaultPart.GPS: "gps",
    FaultPart.RANGE_FINDER: "range_finder",
    FaultPart.OPTICAL_FLOW: "optical_flow",
}


def readings(time_us):
    """All sensors have a sample that changes with time."""
    value = time_us * 1e-6
    return Readings(
        time_us,
        ImuSample(time_us, 4000, (value, 0.0, 0.0), (0.0, value, -9.8)),
        MagnetometerSample(time_us, (0.2, value, 0.4)),
        BarometerSample(time_us, 95_000.0 + value, 288.0),
        GpsSample(time_us, FixType.FIX_3D, 47.0, 8.0, 500.0 + value, (value, 0.0, 0.0), 1.0, 1.0, 0.1, 12),
        RangeSample(time_us, 2.0 + value),
        FlowSample(time_us, 20_000, (value, 0.0), (0.0, value), 200),
        15.0 + value,
        3.0,
    )


def pose(time_us):
    return ExternalPose(
        time_us, (1.0, time_us * 1e-6, -2.0), LEVEL, None, (1e-6,) * 3, (1e-5,) * 3, (nan,) * 3
    )


def measured(part, arrived, arrived_pose):
    """The sample of a part, or what of a vector."""
    if part is FaultPart.EXTERNAL_POSE:
        return arrived_pose
    if part is FaultPart.BATTERY_MONITOR:
        return (arrived.battery_voltage_v, arrived.battery_current_a)
    if part is FaultPart.GYROSCOPE:
        return arrived.imu and arrived.imu.angular_rate_frd_rad_s
    if part is FaultPart.ACCELEROMETER:
        return arrived.imu and arrived.imu.specific_force_frd_m_s2
    return getattr(arrived, FIELDS[part])


def run(part, kind, size=None, ticks=200, seed=7):
    """What a part delivers in each tick with a fault, and what it would without."""
    faults = SensorFaults(seed, ideal=False)
    faults.begin(Fault(part=part, kind=kind, size=size))
    found = []
    for tick in range(1, ticks + 1):
        time_us = tick * 4000
        true = measured(part, readings(time_us), pose(time_us))
        found.append((true, measured(part, *faults.change(readings(time_us), pose(time_us)))))
    return found


def first_number(sample):
    if isinstance(sample, tuple):
        return sample[0]
    fields = ("field_frd_gauss", "pressure_pa", "latitude_deg", "distance_m", "flow_rad", "position_ned_m")
    value = next(getattr(sample, field) for field in fields if hasattr(sample, field))
    return value[0] if isinstance(value, tuple) else value


SENSORS = [
    part
    for part in FaultPart
    if FaultKind.OFF in SIZES[part] and part not in ("motor", "camera", "link", "rc")
]
SAMPLED = [*FIELDS, FaultPart.EXTERNAL_POSE]


@pytest.mark.parametrize("part", SAMPLED)
def test_a_sensor_that_is_off_delivers_nothing(part):
    assert {found for _, found in run(part, FaultKind.OFF)} == {None}


@pytest.mark.parametrize("part", [FaultPart.GYROSCOPE, FaultPart.ACCELEROMETER])
def test_half_an_imu_delivers_no_numbers_and_without_both_halves_nothing_comes(part):
    assert all(map(isnan, run(part, FaultKind.OFF)[0][1]))
    faults = SensorFaults(0, ideal=False)
    for each in (FaultPart.GYROSCOPE, FaultPart.ACCELEROMETER):
        faults.begin(Fault(part=each, kind=FaultKind.OFF))
    assert faults.change(readings(4000), None)[0].imu is None


@pytest.mark.parametrize("part", SENSORS)
def test_a_stuck_sensor_repeats_its_value_with_new_times(part):
    samples = [found for _, found in run(part, FaultKind.STUCK)]
    if isinstance(samples[0], tuple):
        assert set(samples) == {samples[0]}
    else:
        assert {replace(sample, time_us=0) for sample in samples} == {replace(samples[0], time_us=0)}
        assert [sample.time_us for sample in samples] == [4000 * tick for tick in range(1, 201)]


@pytest.mark.parametrize("part", SENSORS)
def test_a_wrong_sensor_has_a_constant_error(part):
    expected = {FaultPart.GPS: 1.5 / 111_320, FaultPart.OPTICAL_FLOW: 1.5 * 0.02}.get(part, 1.5)
    pairs = run(part, FaultKind.WRONG, 1.5)
    differences = [first_number(found) - first_number(true) for true, found in pairs]
    assert differences == [pytest.approx(expected, rel=1e-4)] * len(pairs)


@pytest.mark.parametrize("part", SENSORS)
def test_noise_has_the_declared_size_and_the_seeds_numbers(part):
    pairs = run(part, FaultKind.NOISY, 2.0, ticks=2000)
    unit = {FaultPart.GPS: 1 / 111_320, FaultPart.OPTICAL_FLOW: 0.02}.get(part, 1.0)
    errors = [(first_number(found) - first_number(true)) / unit for true, found in pairs]
    assert pstdev(errors) == pytest.approx(2.0, rel=0.1)
    assert pairs == run(part, FaultKind.NOISY, 2.0, ticks=2000)
    assert pairs != run(part, FaultKind.NOISY, 2.0, ticks=2000, seed=8)


@pytest.mark.parametrize("part", SAMPLED)
def test_a_delayed_sample_keeps_the_time_at_which_it_was_true(part):
    found = [sample for _, sample in run(part, FaultKind.DELAYED, 0.1)]
    assert found[:25] == [None] * 25
    assert [sample.time_us for sample in found[25:]] == [4000 * tick for tick in range(1, 176)]


@pytest.mark.parametrize("part", SAMPLED)
def test_a_lossy_sensor_loses_the_declared_share(part):
    lost = sum(found is None for _, found in run(part, FaultKind.LOSSY, 0.3, ticks=2000))
    assert lost / 2000 == pytest.approx(0.3, abs=0.04)


def test_a_scaled_gyroscope():
    assert run(FaultPart.GYROSCOPE, FaultKind.SCALED, 1.2)[9][1][0] == pytest.approx(0.04 * 1.2)


def test_an_ended_fault_leaves_no_trace():
    faults = SensorFaults(0, ideal=False)
    fault = Fault(part=FaultPart.GPS, kind=FaultKind.OFF)
    faults.begin(fault)
    assert faults.active
    faults.end(fault)
    assert not faults.active
    assert faults.change(readings(4000), pose(4000)) == (readings(4000), pose(4000))


def ideal_sample():
    return Sensors(1000, (1.0, 2.0, 3.0), (0.1, 0.2, 0.3), LEVEL, (0.0,) * 3, (0.0, 0.0, -9.8))


@pytest.mark.parametrize("part", [FaultPart.GPS, FaultPart.EXTERNAL_POSE])
def test_ideal_sensors_without_a_position_have_only_a_height(part):
    faults = SensorFaults(0, ideal=True)
    faults.begin(Fault(part=part, kind=FaultKind.OFF))
    true = ideal_sample()
    found = faults.change_ideal(true)
    assert all(map(isnan, found.position_ned_m[:2] + found.velocity_ned_m_s[:2]))
    assert (found.position_ned_m[2], found.velocity_ned_m_s[2]) == (3.0, 0.3)
    assert found.attitude == LEVEL
    assert true == ideal_sample()  # the world's sample is not changed


def test_a_battery_monitor_that_is_off_measures_no_voltage():
    faults = SensorFaults(0, ideal=True)
    faults.begin(Fault(part=FaultPart.BATTERY_MONITOR, kind=FaultKind.OFF))
    found = faults.change_ideal(ideal_sample())
    assert (found.battery_voltage_v, found.position_ned_m) == (0.0, (1.0, 2.0, 3.0))
