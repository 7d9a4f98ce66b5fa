"""A vehicle that lags, is too slow or drifts is corrected; an ideal one gets its commands unchanged."""

from math import cos, exp, hypot, pi, remainder, sin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from offboard.drone import DroneState, VelocityFluCommand
from offboard.link.tracking import (
    INITIAL_LAG_S,
    MAX_CORRECTION_M_S,
    MAX_CORRECTION_RAD_S,
    MAX_LAG_S,
    MAX_OFFSET_M,
    MIN_OFFSET_M,
    CommandTracker,
    LagEstimate,
)

STEP_S = 0.05


class Vehicle:
    """Reaches a share of the commanded velocity with a lag, and drifts."""

    def __init__(self, *, lag_s=0.25, share=1.0, drift=(0.0, 0.0, 0.0), yaw=0.4):
        self.lag_s, self.share, self.drift = lag_s, share, drift
        self.time_us, self.position, self.yaw = 0, [0.0, 0.0, 1.0], yaw
        self.velocity, self.rate = [0.0, 0.0, 0.0], 0.0

    @property
    def state(self):
        return DroneState(self.time_us, *self.position, self.yaw, tuple(self.velocity), True, True)

    def fly(self, command):
        for _ in range(10):
            step_s = STEP_S / 10
            c, s = cos(self.yaw), sin(self.yaw)
            forward, left = command.forward_m_s, command.left_m_s
            wanted = (c * forward - s * left, s * forward + c * left, command.up_m_s)
            gain = min(1.0, step_s / self.lag_s) if self.lag_s else 1.0
            for axis in range(3):
                self.velocity[axis] += gain * (self.share * wanted[axis] - self.velocity[axis])
                self.position[axis] += (self.velocity[axis] + self.drift[axis]) * step_s
            self.rate += gain * (command.yaw_rate_rad_s - self.rate)
            self.yaw = remainder(self.yaw + self.rate * step_s, 2 * pi)
        self.time_us += round(STEP_S * 1e6)


def fly(vehicle, commands, tracker=None):
    """Fly each command for its seconds; returns each command with what was sent."""
    tracker = tracker or CommandTracker()
    sent = []
    for command, seconds in commands:
        for _ in range(round(seconds / STEP_S)):
            sent.append((command, tracker.correct(command, vehicle.state)))
            vehicle.fly(sent[-1][1])
    return sent


HOVER = VelocityFluCommand()
AHEAD = VelocityFluCommand(forward_m_s=0.3)


@pytest.mark.parametrize("lag_s", [0.0, 0.15, 0.3])
def test_an_ideal_vehicle_gets_its_commands_unchanged(lag_s):
    commands = [
        (VelocityFluCommand(up_m_s=0.5), 3.0),
        (VelocityFluCommand(forward_m_s=1.0), 4.0),
        (HOVER, 3.0),
        (VelocityFluCommand(left_m_s=-0.1, yaw_rate_rad_s=0.2), 3.0),
        (VelocityFluCommand(yaw_rate_rad_s=1.0), 5.0),
        (HOVER, 2.0),
    ]
    sent = fly(Vehicle(lag_s=lag_s), commands)
    assert all(got is wanted for wanted, got in sent)


def test_a_vehicle_that_is_too_slow_still_flies_the_whole_distance():
    """As PX4 under velocity setpoints: it flies half of 0.3 m/s for the first seconds."""
    slow = {"lag_s": 0.8, "share": 0.6, "yaw": 0.0}
    alone, helped = Vehicle(**slow), Vehicle(**slow)
    for _ in range(80):
        alone.fly(AHEAD)
    tracker = CommandTracker()
    fly(helped, [(AHEAD, 4.0)], tracker)
    assert tracker.active
    assert alone.position[0] < 0.65
    assert helped.position[0] > 0.85
    fly(helped, [(HOVER, 4.0)], tracker)
    assert helped.position[0] == pytest.approx(1.2, abs=0.1)


@pytest.mark.parametrize("lag_s", [0.6, 0.7])
def test_a_vehicle_with_lag_follows_quickly_once_the_lag_is_measured(lag_s):
    """Its lag is measured and compensated."""
    alone, helped, tracker = Vehicle(lag_s=lag_s, yaw=0.0), Vehicle(lag_s=lag_s, yaw=0.0), CommandTracker()
    turn = VelocityFluCommand(yaw_rate_rad_s=0.5)
    fly(
        helped, [(VelocityFluCommand(forward_m_s=1.0), 2.0), (HOVER, 2.0), (turn, 2.0), (HOVER, 2.0)], tracker
    )
    assert tracker.active
    alone.yaw = helped.yaw
    wanted = VelocityFluCommand(forward_m_s=0.3, yaw_rate_rad_s=0.3)
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
    fly(vehicle, [(HOVER, 20.0)])
    off_m = hypot(vehicle.position[0], vehicle.position[1], vehicle.position[2] - 1.0)
    assert off_m < MIN_OFFSET_M + 0.02 + hypot(*drift)
    if hypot(*drift) > 0.05:
        assert hypot(*(v + d for v, d in zip(vehicle.velocity, drift, strict=True))) < 0.02


@given(st.floats(-pi, pi), st.lists(st.tuples(*[st.floats(-1, 1)] * 4), min_size=1, max_size=8))
@settings(max_examples=50)
def test_the_correction_is_bounded_and_finite(yaw, commands):
    vehicle = Vehicle(lag_s=1.0, share=0.5, drift=(0.3, -0.3, 0.2), yaw=yaw)
    for wanted, got in fly(vehicle, [(VelocityFluCommand(*each), 1.0) for each in commands]):
        added = (
            got.forward_m_s - wanted.forward_m_s,
            got.left_m_s - wanted.left_m_s,
            got.up_m_s - wanted.up_m_s,
        )
        assert hypot(*added) <= MAX_CORRECTION_M_S + 1e-9
        assert abs(got.yaw_rate_rad_s - wanted.yaw_rate_rad_s) <= MAX_CORRECTION_RAD_S + 1e-9


def test_a_vehicle_held_down_does_not_wind_the_offset_up():
    """On the ground, while PX4 spools up: afterwards it does not shoot past the goal."""
    tracker, vehicle = CommandTracker(), Vehicle(lag_s=0.0, share=0.0)
    fly(vehicle, [(VelocityFluCommand(up_m_s=0.5), 5.0)], tracker)
    vehicle.share, vehicle.lag_s = 1.0, 0.3
    fly(vehicle, [(HOVER, 8.0)], tracker)
    assert 1.0 < vehicle.position[2] <= 1.0 + MAX_OFFSET_M + 0.05


def test_after_a_gap_the_model_starts_again_at_the_vehicle():
    tracker, vehicle = CommandTracker(), Vehicle()
    fly(vehicle, [(HOVER, 1.0)], tracker)
    vehicle.position[0] += 0.4
    vehicle.time_us += 1_000_000
    assert tracker.correct(HOVER, vehicle.state) == HOVER
    vehicle.fly(HOVER)
    assert tracker.correct(HOVER, vehicle.state) == HOVER


def test_without_time_nothing_moves():
    tracker, vehicle = CommandTracker(), Vehicle()
    for _ in range(5):
        assert tracker.correct(AHEAD, vehicle.state) == AHEAD


def test_the_offset_across_the_command_is_forgotten_and_along_it_is_not():
    """The mission steers by the camera: pushed back to its old line, the vehicle would miss its aim."""
    tracker, vehicle = CommandTracker(), Vehicle(yaw=0.0)
    fly(vehicle, [(HOVER, 1.0)], tracker)
    vehicle.position[0] -= 0.3
    vehicle.position[1] += 0.3
    sent = [tracker.correct(AHEAD, vehicle.state)]
    for _ in range(80):
        vehicle.time_us += 50_000
        vehicle.position[0] += AHEAD.forward_m_s * STEP_S  # continues, parallel to the command
        sent.append(tracker.correct(AHEAD, vehicle.state))
    assert sent[0].left_m_s < -0.1
    assert sent[-1].left_m_s == pytest.approx(0.0, abs=0.02)
    assert sent[-1].forward_m_s > AHEAD.forward_m_s + 0.1


def watch(estimate, lag_s, commanded, seconds=20.0):
    """Show an estimate a vehicle of first order, commanded by `commanded(time)`."""
    speed = 0.0
    for tick in range(round(seconds / STEP_S)):
        wanted = commanded(tick * STEP_S)
        speed = wanted + exp(-STEP_S / lag_s) * (speed - wanted)
        estimate.update(wanted, speed, STEP_S)
    return estimate.lag_s


def steps(time_s):
    return 0.5 if time_s % 4.0 < 2.0 else -0.2


@pytest.mark.parametrize("lag_s", [0.1, 0.2, 0.4, 0.6])
@pytest.mark.parametrize("commanded", [steps, lambda time_s: 0.4 * sin(2.0 * time_s)])
def test_the_lag_is_measured(lag_s, commanded):
    assert watch(LagEstimate(0.1), lag_s, commanded) == pytest.approx(lag_s, abs=0.05)


def test_the_lag_is_the_initial_one_before_a_change_and_noise_is_no_change():
    estimate = LagEstimate(0.1)
    assert estimate.lag_s == INITIAL_LAG_S
    for tick in range(200):
        estimate.update(0.3, 0.04 * (-1) ** tick, STEP_S)
    assert estimate.lag_s == INITIAL_LAG_S


def test_the_lag_is_bounded():
    assert watch(LagEstimate(0.1), 2.0, lambda _: 1.0) == MAX_LAG_S
    ahead = LagEstimate(0.1)
    for tick in range(100):
        ahead.update(0.0, 0.02 * tick, STEP_S)  # speeds up without a command
    assert ahead.lag_s == 0.0
