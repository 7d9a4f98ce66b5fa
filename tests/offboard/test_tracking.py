"""A vehicle that lags, stays behind or drifts goes where its commands lead; one that obeys is left alone."""

from math import cos, hypot, pi, remainder, sin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from offboard.drone import DroneState, VelocityCommand
from offboard.link.tracking import HELP_FROM_M, LEASH_M, MOST_M_S, MOST_RAD_S, CommandTracker

STEP_S = 0.05


class Vehicle:
    """Reaches a share of what it is told with a lag, and is carried off by a drift."""

    def __init__(self, *, lag_s=0.25, share=1.0, drift=(0.0, 0.0, 0.0), yaw=0.4):
        self.lag_s, self.share, self.drift = lag_s, share, drift
        self.time_us, self.place, self.yaw = 0, [0.0, 0.0, 1.0], yaw
        self.velocity, self.rate = [0.0, 0.0, 0.0], 0.0

    @property
    def state(self):
        return DroneState(self.time_us, *self.place, self.yaw, tuple(self.velocity), True, True)

    def fly(self, command):
        for _ in range(10):
            step_s = STEP_S / 10
            c, s = cos(self.yaw), sin(self.yaw)
            forward, left = command.forward_m_s, command.left_m_s
            wanted = (c * forward - s * left, s * forward + c * left, command.up_m_s)
            gain = min(1.0, step_s / self.lag_s) if self.lag_s else 1.0
            for axis in range(3):
                self.velocity[axis] += gain * (self.share * wanted[axis] - self.velocity[axis])
                self.place[axis] += (self.velocity[axis] + self.drift[axis]) * step_s
            self.rate += gain * (command.yaw_rate_rad_s - self.rate)
            self.yaw = remainder(self.yaw + self.rate * step_s, 2 * pi)
        self.time_us += round(STEP_S * 1e6)


def fly(vehicle, commands, tracker=None):
    """Fly each command for its seconds; what was sent."""
    tracker = tracker or CommandTracker()
    sent = []
    for command, seconds in commands:
        for _ in range(round(seconds / STEP_S)):
            sent.append((command, tracker.correct(command, vehicle.state)))
            vehicle.fly(sent[-1][1])
    return sent


STAND = VelocityCommand()
AHEAD = VelocityCommand(forward_m_s=0.3)


@pytest.mark.parametrize("lag_s", [0.0, 0.15, 0.3])
def test_a_vehicle_that_obeys_gets_its_commands_unchanged(lag_s):
    commands = [
        (VelocityCommand(up_m_s=0.5), 3.0),
        (VelocityCommand(forward_m_s=1.0), 4.0),
        (STAND, 3.0),
        (VelocityCommand(left_m_s=-0.1, yaw_rate_rad_s=0.2), 3.0),
        (VelocityCommand(yaw_rate_rad_s=1.0), 5.0),
        (STAND, 2.0),
    ]
    sent = fly(Vehicle(lag_s=lag_s), commands)
    assert all(got is wanted for wanted, got in sent)


def test_a_vehicle_that_stays_behind_still_goes_the_whole_way():
    """As PX4 under velocity setpoints: it flies half of 0.3 m/s for the first seconds."""
    slow = {"lag_s": 0.8, "share": 0.6, "yaw": 0.0}
    alone, helped = Vehicle(**slow), Vehicle(**slow)
    for _ in range(80):
        alone.fly(AHEAD)
    tracker = CommandTracker()
    fly(helped, [(AHEAD, 4.0)], tracker)
    assert tracker.helps
    assert alone.place[0] < 0.65
    assert helped.place[0] > 0.85
    fly(helped, [(STAND, 4.0)], tracker)
    assert helped.place[0] == pytest.approx(1.2, abs=0.1)


@pytest.mark.parametrize("lag_s", [0.6, 0.7])
def test_a_late_vehicle_answers_quickly_once_it_is_known(lag_s):
    """Its lag is learned from its own answers, and sent ahead of."""
    alone, helped, tracker = Vehicle(lag_s=lag_s, yaw=0.0), Vehicle(lag_s=lag_s, yaw=0.0), CommandTracker()
    turn = VelocityCommand(yaw_rate_rad_s=0.5)
    fly(helped, [(VelocityCommand(forward_m_s=1.0), 2.0), (STAND, 2.0), (turn, 2.0), (STAND, 2.0)], tracker)
    assert tracker.helps
    alone.yaw = helped.yaw
    wanted = VelocityCommand(forward_m_s=0.3, yaw_rate_rad_s=0.3)
    fly(helped, [(wanted, 0.4)], tracker)
    for _ in range(8):
        alone.fly(wanted)
    assert hypot(*alone.velocity) < 0.18
    assert hypot(*helped.velocity) == pytest.approx(0.3, abs=0.07)
    assert alone.rate < 0.18
    assert helped.rate == pytest.approx(0.3, abs=0.07)


@given(st.tuples(*[st.floats(-0.15, 0.15)] * 3))
@settings(max_examples=30)
def test_a_drifting_vehicle_is_held(drift):
    vehicle = Vehicle(lag_s=0.8, drift=drift)
    fly(vehicle, [(STAND, 20.0)])
    off_m = hypot(vehicle.place[0], vehicle.place[1], vehicle.place[2] - 1.0)
    assert off_m < HELP_FROM_M + 0.02 + hypot(*drift)
    if hypot(*drift) > 0.05:
        assert hypot(*(v + d for v, d in zip(vehicle.velocity, drift, strict=True))) < 0.02


@given(st.floats(-pi, pi), st.lists(st.tuples(*[st.floats(-1, 1)] * 4), min_size=1, max_size=8))
@settings(max_examples=50)
def test_the_help_is_bounded_and_finite(yaw, wishes):
    vehicle = Vehicle(lag_s=1.0, share=0.5, drift=(0.3, -0.3, 0.2), yaw=yaw)
    for wanted, got in fly(vehicle, [(VelocityCommand(*wish), 1.0) for wish in wishes]):
        added = (
            got.forward_m_s - wanted.forward_m_s,
            got.left_m_s - wanted.left_m_s,
            got.up_m_s - wanted.up_m_s,
        )
        assert hypot(*added) <= MOST_M_S + 1e-9
        assert abs(got.yaw_rate_rad_s - wanted.yaw_rate_rad_s) <= MOST_RAD_S + 1e-9


def test_a_vehicle_held_down_does_not_wind_the_place_up():
    """On the ground, while PX4 spools up: afterwards it does not shoot past the goal."""
    tracker, vehicle = CommandTracker(), Vehicle(lag_s=0.0, share=0.0)
    fly(vehicle, [(VelocityCommand(up_m_s=0.5), 5.0)], tracker)
    vehicle.share, vehicle.lag_s = 1.0, 0.3
    fly(vehicle, [(STAND, 8.0)], tracker)
    assert 1.0 < vehicle.place[2] <= 1.0 + LEASH_M + 0.05


def test_after_a_gap_the_vehicle_is_taken_from_where_it_is():
    tracker, vehicle = CommandTracker(), Vehicle()
    fly(vehicle, [(STAND, 1.0)], tracker)
    vehicle.place[0] += 0.4
    vehicle.time_us += 1_000_000
    assert tracker.correct(STAND, vehicle.state) == STAND
    vehicle.fly(STAND)
    assert tracker.correct(STAND, vehicle.state) == STAND


def test_without_time_nothing_moves():
    tracker, vehicle = CommandTracker(), Vehicle()
    for _ in range(5):
        assert tracker.correct(AHEAD, vehicle.state) == AHEAD


def test_what_is_off_beside_the_way_is_forgotten_and_along_it_is_not():
    """The mission steers by sight: pushed back to the old way, the vehicle would come past its aim."""
    tracker, vehicle = CommandTracker(), Vehicle(yaw=0.0)
    fly(vehicle, [(STAND, 1.0)], tracker)
    vehicle.place[0] -= 0.3
    vehicle.place[1] += 0.3
    sent = [tracker.correct(AHEAD, vehicle.state)]
    for _ in range(80):
        vehicle.time_us += 50_000
        vehicle.place[0] += AHEAD.forward_m_s * STEP_S  # goes on, parallel to the way
        sent.append(tracker.correct(AHEAD, vehicle.state))
    assert sent[0].left_m_s < -0.1
    assert sent[-1].left_m_s == pytest.approx(0.0, abs=0.02)
    assert sent[-1].forward_m_s > AHEAD.forward_m_s + 0.1
