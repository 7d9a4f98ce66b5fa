"""Where the drone was when an image was exposed."""

from math import cos, radians, sin

import pytest

from framerunner.geometry.rotations import euler_from_quaternion, quaternion_from_euler
from offboard.drone import DroneState
from offboard.navigation.pose_history import PoseHistory


def state(time_us: int, age_s: float = 0.01) -> DroneState:
    """A drone on a circle of 1 m at 1 rad/s, nose along the circle and rolled."""
    t = (time_us * 1e-6) - age_s
    return DroneState(
        time_us,
        *(cos(t), sin(t), 1.0),
        yaw=0.0,
        velocity_arena_m_s=(-sin(t), cos(t), 0.0),
        position_age_s=age_s,
        attitude_arena=quaternion_from_euler(0.1, 0.0, time_us * 1e-6),
    )


def history(*times_us: int) -> PoseHistory:
    """What is known after states at these times."""
    known = PoseHistory()
    for time_us in times_us:
        known.add(state(time_us))
    return known


def test_pose_between_two_states_is_that_of_the_image_s_time() -> None:
    pose = history(*range(0, 1_000_001, 50_000)).at(517_000)
    assert pose is not None
    assert pose.position_m == pytest.approx((cos(0.517), sin(0.517), 1.0), abs=1e-5)
    assert euler_from_quaternion(pose.attitude_arena) == pytest.approx((0.1, 0.0, 0.517), abs=1e-4)


def test_late_repeated_and_swapped_states_change_nothing() -> None:
    expected = history(400_000, 450_000, 500_000, 550_000).at(467_000)
    assert history(400_000, 500_000, 450_000, 450_000, 550_000, 500_000).at(467_000) == expected


def test_pose_is_extrapolated_by_a_tenth_of_a_second_and_is_then_unknown() -> None:
    known = history(400_000, 450_000, 500_000)
    inside, ahead = known.at(475_000), known.at(560_000)
    assert inside is not None
    assert ahead is not None
    assert ahead.position_m == pytest.approx((cos(0.56), sin(0.56), 1.0), abs=0.005)
    assert euler_from_quaternion(ahead.attitude_arena)[2] == pytest.approx(0.56, abs=radians(0.2))
    assert ahead.position_std_m > inside.position_std_m
    assert ahead.attitude_std_rad > inside.attitude_std_rad
    assert known.at(620_000) is None
    assert known.at(250_000) is None
    assert PoseHistory().at(0) is None


def test_pose_in_a_gap_of_telemetry_and_long_ago_is_unknown() -> None:
    assert history(0, 50_000, 1_000_000, 1_050_000).at(500_000) is None
    assert history(*range(0, 5_000_000, 50_000)).at(1_000_000) is None
