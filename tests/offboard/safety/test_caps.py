from math import hypot, inf, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.errors import SettingError
from offboard.drone import DroneState, VelocityCommand
from offboard.keep_in_box import Box
from offboard.safety.caps import CapKeeper, Caps

CAPS = Caps(level_m_s=1.0, vertical_m_s=0.5, yaw_rate_rad_s=1.5, height_m=2.0)
BOX = Box((-5.0, -5.0, 0.15), (5.0, 5.0, 4.0), (0.0, 0.0))
SPEEDS = st.floats(-100.0, 100.0) | st.sampled_from([inf, -inf, nan])


@given(SPEEDS, SPEEDS, SPEEDS, SPEEDS)
def test_no_command_exceeds_the_caps(forward, left, up, rate):
    command = CapKeeper(CAPS, None).limit(VelocityCommand(forward, left, up, rate), None)
    assert hypot(command.forward_m_s, command.left_m_s) <= 1.0 + 1e-9
    assert abs(command.up_m_s) <= 0.5
    assert abs(command.yaw_rate_rad_s) <= 1.5


def test_the_direction_of_a_capped_speed_stays():
    command = CapKeeper(CAPS, None).limit(VelocityCommand(6.0, 8.0, 0.1, 0.2), None)
    assert (command.forward_m_s, command.left_m_s) == pytest.approx((0.6, 0.8))
    assert (command.up_m_s, command.yaw_rate_rad_s) == (0.1, 0.2)


def test_a_command_within_the_caps_is_the_same_object():
    command = VelocityCommand(0.5, 0.5, 0.5, 1.0)
    assert CapKeeper(CAPS, BOX).limit(command, DroneState(0, 0.0, 0.0, 1.0, 0.0)) is command


def test_each_cap_is_said_once(caplog):
    keeper = CapKeeper(CAPS, None)
    for _ in range(3):
        keeper.limit(VelocityCommand(6.0, 0.0, 2.0), None)
    assert keeper.acted == {"level speed", "vertical speed"}
    assert len(caplog.records) == 2


def test_the_height_counts_from_the_start_and_never_above_the_ceiling():
    assert CAPS.box(BOX, 0.5).high_m[2] == 2.5
    assert Caps(height_m=50.0).box(BOX, 0.5).high_m[2] == 4.0
    assert Caps().box(BOX, 0.5) is BOX


def test_no_climb_at_the_cap():
    keeper = CapKeeper(CAPS, CAPS.box(BOX, 0.5))
    at_cap = DroneState(0, 0.0, 0.0, 2.5, 0.0)
    assert keeper.limit(VelocityCommand(0.0, 0.0, 0.4), at_cap).up_m_s == pytest.approx(0.0)


def test_the_way_back_into_the_box_is_capped_too():
    slow = Caps(level_m_s=0.2, vertical_m_s=0.1)
    outside = DroneState(0, 9.0, 9.0, 9.0, 0.0)
    back = CapKeeper(slow, BOX).limit(VelocityCommand(), outside)
    assert hypot(back.forward_m_s, back.left_m_s) == pytest.approx(0.2)
    assert (back.forward_m_s < 0, back.left_m_s < 0, back.up_m_s) == (True, True, -0.1)


def test_a_cap_that_leaves_no_room_is_refused():
    low = Box((-5.0, -5.0, 1.0), (5.0, 5.0, 4.0), (0.0, 0.0))
    with pytest.raises(SettingError, match="--max-height"):
        Caps(height_m=0.3).box(low, 0.5)
