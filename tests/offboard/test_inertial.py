"""The IMU's samples and the vehicle's accuracy, from MAVSDK's messages."""

import json
from types import SimpleNamespace

import pytest

from offboard.link.inertial import InertialFeed


class Vehicle:
    def __init__(self, *, tells_accuracy=True):
        self.feed, self.take = InertialFeed(), {}
        self.feed.subscribe(self, tells_accuracy=tells_accuracy)

    def subscribe_message(self, name, callback):
        self.take[name] = callback

    def send(self, name, component=1, **fields):
        told = SimpleNamespace(system_id=1, component_id=component, fields_json=json.dumps(fields))
        self.take[name](told, None)

    def samples(self, times_us, **changed):
        for time_us in times_us:
            fields = {"time_usec": time_us, "xacc": 0.1, "yacc": 0.2, "zacc": -9.8, "zgyro": 0.5}
            self.send("HIGHRES_IMU", **fields | changed)


def test_samples_are_means_without_gaps_in_the_body_s_axes_forward_left_up():
    vehicle = Vehicle()
    vehicle.samples(range(4_000, 104_000, 4_000))
    first = vehicle.feed.take(50_000)
    assert [sample.time_us for sample in first] == list(range(8_000, 50_000, 4_000))
    assert first[0].specific_force_flu_m_s2 == (0.1, -0.2, 9.8)
    assert first[0].angular_rate_flu_rad_s == (0.0, 0.0, -0.5)
    assert [sample.time_us for sample in vehicle.feed.take(200_000)] == list(range(52_000, 104_000, 4_000))


def test_old_and_repeated_samples_are_ignored():
    vehicle = Vehicle()  # the first one only tells when the interval of the second began
    vehicle.samples([4_000, 8_000, 12_000, 12_000, 28_000, 32_000, 12_000])
    assert [sample.time_us for sample in vehicle.feed.take(50_000)] == [8_000, 12_000, 28_000, 32_000]


def test_samples_that_leave_time_out_are_not_used():
    vehicle = Vehicle()  # as PX4 sends them by itself: 50 of 200 a second
    vehicle.samples(range(20_000, 1_000_000, 20_000))
    assert vehicle.feed.take(1_000_000) == ()


def test_messages_of_others_and_numbers_that_are_none_are_ignored():
    vehicle = Vehicle()
    vehicle.samples([4_000, 8_000])
    vehicle.samples([12_000], component=191)
    vehicle.samples([16_000], xacc=None)
    vehicle.samples([20_000], xacc=1e30)
    assert [sample.time_us for sample in vehicle.feed.take(50_000)] == [8_000]


@pytest.mark.parametrize("sends", [False, True])
async def test_a_vehicle_that_sends_odometry_keeps_its_rate(sends):
    vehicle, requested = Vehicle(), []

    async def note(rate_hz):
        requested.append(rate_hz)

    if sends:
        covariance = {"pose_covariance": [0.01] * 21, "velocity_covariance": [0.01] * 21}
        vehicle.send("ODOMETRY", time_usec=1000, frame_id=1, reset_counter=0, **covariance)
    await vehicle.feed.request(SimpleNamespace(set_rate_imu=note, set_rate_odometry=note))
    assert requested == ([250.0] if sends else [250.0, 10.0])


@pytest.mark.parametrize("unknown", [False, True])
def test_the_accuracy_is_the_worse_of_two_axes_and_none_if_the_vehicle_does_not_know_it(unknown):
    vehicle = Vehicle()
    pose, velocity = [None] * 21, [None] * 21
    pose[0], pose[6], pose[11], pose[20] = 0.0001, 0.0004, 0.01, None if unknown else 0.0009
    velocity[0], velocity[6], velocity[11] = 0.0016, 0.0001, 0.0025
    fields = {"time_usec": 1000, "frame_id": 1, "pose_covariance": pose, "velocity_covariance": velocity}
    vehicle.send("ODOMETRY", reset_counter=3, **fields)
    accuracy = vehicle.feed.accuracy
    if unknown:
        assert accuracy is None
        return
    assert (accuracy.position_std_m, accuracy.height_std_m) == pytest.approx((0.02, 0.1))
    assert (accuracy.velocity_std_m_s, accuracy.climb_std_m_s) == pytest.approx((0.04, 0.05))
    assert (accuracy.heading_std_rad, accuracy.resets) == (pytest.approx(0.03), 3)


@pytest.mark.parametrize(("used", "drifts"), [(0x40, True), (0x60, False), (0xC0, False), (0x0, False)])
def test_a_vehicle_that_tells_no_accuracy_drifts_with_flow_alone(used, drifts):
    vehicle = Vehicle(tells_accuracy=False)
    vehicle.samples(range(4_000, 104_000, 4_000))
    vehicle.send("SYS_STATUS", onboard_control_sensors_enabled=used)
    assert vehicle.feed.drifts == drifts
