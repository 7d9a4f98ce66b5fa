"""What limits a velocity: the class, the box that no mission leads the drone out of, and the caps."""

from __future__ import annotations

from math import cos, hypot, inf, nan, pi, sin
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from framerunner.errors import SettingError
from offboard.app import fly_mission
from offboard.drone import DroneState, LimitedCommand, VelocityFluCommand
from offboard.limits import (
    CONTEST,
    Box,
    Caps,
    CommandLimits,
    OutsideBoxError,
    VelocityLimits,
    confine,
    flight_box,
    outside,
)
from offboard.mavsdk_drone import MavsdkDrone
from scenarios.loader import load_scenario
from tests.offboard.fakes import KinematicDrone, NoCamera, runaway

BOX = flight_box(load_scenario("test-case-1"))
START = (-3.0, -3.0)


def state(x=0.0, y=0.0, z=2.0, yaw=0.0, velocity=(0.0, 0.0, 0.0), time_us=0, age_s=0.0):
    return DroneState(time_us, x, y, z, yaw, velocity, armed=True, offboard=True, position_age_s=age_s)


def in_arena(command, yaw):
    c, s = cos(yaw), sin(yaw)
    forward, left = command.forward_m_s, command.left_m_s
    return (c * forward - s * left, s * forward + c * left, command.up_m_s)


def test_the_box_is_the_arena_and_its_margin_with_the_floor_where_it_is():
    assert Box((-6.0, -6.0, 0.15), (6.0, 6.0, 5.0), START) == BOX
    assert flight_box(load_scenario("test-case-1"), 0.51).low_m[2] == pytest.approx(0.66)
    scenario = load_scenario("test-case-1")
    arena = scenario.arena.model_copy(update={"margin_m": 0.0})
    assert flight_box(scenario.model_copy(update={"arena": arena})).high_m == (5.0, 5.0, 4.0)


speed = st.floats(-1.0, 1.0)


@given(
    st.tuples(st.floats(-4.7, 4.7), st.floats(-4.7, 4.7), st.floats(1.1, 4.0), st.floats(-pi, pi)),
    st.builds(VelocityFluCommand, speed, speed, speed, speed),
)
def test_inside_the_arena_a_command_is_the_very_same(place, command):
    kept, sides = confine(command, state(*place), BOX)
    assert kept is command
    assert not sides


@given(
    st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(-1, 9), st.floats(-pi, pi)),
    st.tuples(speed, speed, speed),
    st.builds(VelocityFluCommand, speed, speed, speed, speed),
)
def test_nothing_leads_out_and_turning_is_free(place, velocity, command):
    at = state(*place, velocity)
    kept, _ = confine(command, at, BOX)
    assert kept.yaw_rate_rad_s == command.yaw_rate_rad_s
    flown = in_arena(kept, at.yaw)
    near_start = (at.x + 3.0) ** 2 + (at.y + 3.0) ** 2 < 1.0
    for axis, (low, high) in enumerate(zip(BOX.low_m, BOX.high_m, strict=True)):
        p, v = place[axis], flown[axis]
        assert v <= max(high - p, 0.0) / 0.5 + 1e-9
        if axis < 2 or not near_start:
            assert v >= -max(p - low, 0.0) / 0.5 - 1e-9
        if p > high + 0.5:
            assert v == pytest.approx(-0.5) or v < -0.5  # comes back
    assert all(abs(v) <= 1.5 for v in flown)


def test_near_the_start_it_may_land_and_elsewhere_not_sink_to_the_floor():
    down = VelocityFluCommand(up_m_s=-0.3)
    assert confine(down, state(-3.2, -2.8, 0.1), BOX)[0] is down
    assert confine(down, state(1.0, 1.0, 0.1), BOX)[0].up_m_s > 0.0


class Lagging:
    """A vehicle that follows late: first order, and every state and command delayed."""

    def __init__(self, lag_s, delay_ticks):
        self.place, self.velocity = [0.0, 0.0, 2.0], [0.0, 0.0, 0.0]
        self.lag_s = lag_s
        self.waiting = [(0.0, 0.0, 0.0)] * delay_ticks

    def step(self, wanted, dt_s=0.05):
        self.waiting.append(wanted)
        wanted = self.waiting.pop(0)
        for axis in range(3):
            self.velocity[axis] += dt_s / self.lag_s * (wanted[axis] - self.velocity[axis])
            self.place[axis] += dt_s * self.velocity[axis]


@pytest.mark.parametrize(("lag_s", "delay_ticks"), [(0.3, 1), (0.3, 8), (0.6, 4), (0.6, 8)])
@pytest.mark.parametrize("way", [(1, 0, 0), (0, -1, 0), (0.7, 0.7, 0), (0, 0, 1), (0, 0, -1)])
def test_a_vehicle_told_to_fly_on_for_ever_stays_inside(lag_s, delay_ticks, way):
    vehicle, limits, kept_in = Lagging(lag_s, delay_ticks), VelocityLimits(box=BOX), 0
    limited = LimitedCommand(VelocityFluCommand())
    for tick in range(600):
        at = state(*vehicle.place, 0.0, tuple(vehicle.velocity), 50_000 * tick)
        limited = limits.limit(VelocityFluCommand(*map(float, way)), at)
        kept_in += limited.kept_in_box
        vehicle.step(in_arena(limited.command, 0.0))
        assert outside(BOX, state(*vehicle.place)) < 0.005, vehicle.place
    assert limited.remark.startswith("kept in the box: ")
    assert kept_in > 100


def test_a_position_that_is_old_is_no_place_to_fly_by():
    limits = VelocityLimits(box=BOX)
    stopped = limits.limit(VelocityFluCommand(0.5), state(age_s=0.6))
    assert (stopped.command, stopped.kept_in_box) == (VelocityFluCommand(), True)
    assert stopped.remark == "stopped: the position is 0.6 s old"
    assert limits.limit(VelocityFluCommand(0.5), state(age_s=0.1)) == LimitedCommand(VelocityFluCommand(0.5))


def test_a_drone_that_does_not_come_back_is_given_up_and_one_that_does_is_not():
    limits = VelocityLimits(box=BOX)
    for tick in range(100):
        limits.limit(VelocityFluCommand(), state(x=9.0 - 0.02 * tick, time_us=50_000 * tick))
    limits.limit(VelocityFluCommand(), state(x=7.0, time_us=5_000_000))
    limits.limit(VelocityFluCommand(), state(x=9.0, time_us=7_900_000))
    with pytest.raises(OutsideBoxError, match=r"3\.0 m outside its box and does not come back: x 9\.0"):
        limits.limit(VelocityFluCommand(), state(x=9.0, time_us=8_050_000))


@pytest.mark.parametrize("velocity", [(1, 0, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)])
async def test_a_mission_that_runs_away_is_kept_in_and_told_of(tmp_path, velocity):
    mission = runaway(tmp_path, velocity)
    box, moments = Box(BOX.low_m, BOX.high_m, (-4.0, -4.0)), []
    drone = KinematicDrone(0.0, 0.0, 0.5, limits=VelocityLimits(CONTEST, box))
    outcome = await fly_mission(drone, NoCamera(), mission, limit_s=30.0, observer=moments.append)
    assert (outcome.ended, drone.calls[-2:]) == ("timed out", ["hold", "close"])
    assert outcome.kept_in_box_s > 5.0
    assert moments[-1].remark.startswith("kept in the box: ")
    flown = [moment.state for moment in moments if moment.flight_time_s > 3.0]
    assert max(outside(box, each) for each in flown) < 0.005


async def test_a_drone_carried_off_ends_in_hold(tmp_path):
    mission = runaway(tmp_path, (0, 0, 0))
    drone = KinematicDrone(0.0, 0.0, 0.5, limits=VelocityLimits(CONTEST, BOX))
    drone.x = 8.0
    drone._move = lambda dt_s: None  # does not fly back, however it is told to
    outcome = await fly_mission(drone, NoCamera(), mission, limit_s=30.0)
    assert outcome.ended == "aborted"
    assert "2.0 m outside its box and does not come back" in outcome.reason
    assert drone.calls[-2:] == ["hold", "close"]
    assert drone.commands[-1].forward_m_s < 0.0


def test_what_the_adapter_adds_to_a_command_does_not_lead_out_either():
    drone, sent = MavsdkDrone("udpin://127.0.0.1:14540", limits=VelocityLimits(CONTEST, BOX)), []
    drone._commanding, drone._dialect = True, SimpleNamespace(send=sent.append)
    drone._tracker = SimpleNamespace(correct=lambda command, state: VelocityFluCommand(up_m_s=0.7))
    for z in (3.0, 4.9, 5.5):
        drone._latest = state(z=z)
        drone.command(VelocityFluCommand())
    assert [command.up_m_s for command in sent] == pytest.approx([0.7, 0.2, -0.5])


def test_a_mission_that_corrects_its_own_commands_has_them_sent_unchanged():
    limits, sent = VelocityLimits(CONTEST, BOX), []
    drone = MavsdkDrone("udpin://127.0.0.1:14540", limits=limits, corrects=False)
    drone._commanding, drone._dialect = True, SimpleNamespace(send=sent.append)
    drone._tracker = SimpleNamespace(correct=lambda command, state: VelocityFluCommand(up_m_s=0.7))
    drone._latest = state(z=3.0)
    drone.command(VelocityFluCommand(forward_m_s=0.5))
    assert sent == [VelocityFluCommand(forward_m_s=0.5)]


CAPS = Caps(level_m_s=1.0, vertical_m_s=0.5, yaw_rate_rad_s=1.5, height_m=2.0)
SPEEDS = st.floats(-100.0, 100.0) | st.sampled_from([inf, -inf, nan])


@given(SPEEDS, SPEEDS, SPEEDS, SPEEDS)
def test_no_command_exceeds_the_caps(forward, left, up, rate):
    command = VelocityLimits(caps=CAPS).limit(VelocityFluCommand(forward, left, up, rate), None).command
    assert hypot(command.forward_m_s, command.left_m_s) <= 1.0 + 1e-9
    assert abs(command.up_m_s) <= 0.5
    assert abs(command.yaw_rate_rad_s) <= 1.5


def test_the_direction_of_a_capped_speed_stays():
    command = VelocityLimits(caps=CAPS).limit(VelocityFluCommand(6.0, 8.0, 0.1, 0.2), None).command
    assert (command.forward_m_s, command.left_m_s) == pytest.approx((0.6, 0.8))
    assert (command.up_m_s, command.yaw_rate_rad_s) == (0.1, 0.2)


@pytest.mark.parametrize("command", [(0.5, 0.5, 0.5, 1.0), (0.1, -0.0, 0.3, -0.0)])
def test_a_command_that_nothing_limits_is_the_same_to_the_last_bit(command):
    limited = VelocityLimits(CONTEST, BOX, CAPS).limit(VelocityFluCommand(*command), state())
    assert repr(limited.command) == repr(VelocityFluCommand(*command))
    assert not limited.clips


def test_each_cap_is_logged_once_and_named_in_each_command(caplog):
    limits = VelocityLimits(caps=CAPS)
    for _ in range(3):
        limited = limits.limit(VelocityFluCommand(6.0, 0.0, 2.0), None)
    assert [(clip.limit, clip.quantity) for clip in limited.clips] == [
        ("cap", "level speed"),
        ("cap", "vertical speed"),
    ]
    assert limited.remark == "6.00 m/s level commanded, 1 flown; 2.00 m/s upwards commanded, 0.5 flown"
    assert len(caplog.records) == 2


def test_the_box_is_remarked_on_and_the_class_is_not(caplog):
    limited = VelocityLimits(CONTEST, BOX).limit(VelocityFluCommand(inf, 0.2, 0.0, -3.0), state(x=5.9))
    assert [(clip.limit, clip.quantity) for clip in limited.clips] == [("box", "place")]
    assert limited.command.forward_m_s < 0.2
    assert (limited.command.left_m_s, limited.command.yaw_rate_rad_s) == (0.2, -1.0)
    assert limited.remark == "kept in the box: x 6.0 m"
    assert [record.message for record in caplog.records] == [f"{limited.remark} (x 5.9, y 0.0, z 2.0 m)"]


def test_a_level_velocity_of_the_open_class_is_shortened_as_a_whole():
    limits = CommandLimits(forward_m_s=3.0, left_m_s=4.0, level_m_s=2.5)
    assert limits.limited(VelocityFluCommand(inf, inf)) == VelocityFluCommand(1.5, 2.0)


def test_the_height_counts_from_the_start_and_never_above_the_ceiling():
    assert CAPS.box(BOX, 0.5).high_m[2] == 2.5
    assert Caps(height_m=50.0).box(BOX, 0.5).high_m[2] == 5.0
    assert Caps().box(BOX, 0.5) is BOX


def test_no_climb_at_the_cap():
    limits = VelocityLimits(None, CAPS.box(BOX, 0.5), CAPS)
    assert limits.limit(VelocityFluCommand(up_m_s=0.4), state(z=2.5)).command.up_m_s == pytest.approx(0.0)


def test_the_way_back_into_the_box_is_capped_too():
    slow = Caps(level_m_s=0.2, vertical_m_s=0.1)
    back = VelocityLimits(None, BOX, slow).limit(VelocityFluCommand(), state(9.0, 9.0, 9.0)).command
    assert hypot(back.forward_m_s, back.left_m_s) == pytest.approx(0.2)
    assert (back.forward_m_s < 0, back.left_m_s < 0, back.up_m_s) == (True, True, -0.1)


def test_a_cap_that_leaves_no_room_is_refused():
    low = Box((-5.0, -5.0, 1.0), (5.0, 5.0, 4.0), (0.0, 0.0))
    with pytest.raises(SettingError, match="--max-height"):
        Caps(height_m=0.3).box(low, 0.5)
