"""The response of vehicles that answer late is learnt in flight, and their motion is predicted."""

from collections import deque
from dataclasses import replace
from math import cos, exp, hypot, pi, remainder, sin

import pytest

from offboard.drone import DroneState, ResponsePrior, VelocityFluCommand
from offboard.response import ResponseEstimate

STEP_S = 0.05


class Vehicle:
    """Follows commands after a dead time, with a lag; in axes that turn with its heading, or do not.

    With a lag of its own it follows what comes of that with another lag, in axes that turn.
    """

    def __init__(
        self, dead_s, lag_s, *, turning=False, drift_m_s=0.0, own_lag_s=0.0, prior=ResponsePrior.OWN
    ):
        self.prior = prior
        self.own_lag_s, self.own = own_lag_s, (0.0, 0.0)
        self.lag_s, self.turning, self.drift_m_s = lag_s, turning, drift_m_s
        self.waiting = deque([(0.0, 0.0, 0.0, 0.0)] * round(dead_s / STEP_S))
        self.ticks, self.yaw, self.position, self.speeds = 0, 0.3, [0.0, 0.0, 1.0], [0.0] * 4

    @property
    def state(self):
        c, s = (cos(self.yaw), sin(self.yaw)) if self.turning else (1.0, 0.0)
        a, b, up, _ = self.speeds
        x, y = self.own if self.own_lag_s else (c * a - s * b, s * a + c * b)
        velocity = (x, y, up + self.drift_m_s)
        time_us = round(self.ticks * STEP_S * 1e6)
        return DroneState(
            time_us, *self.position, self.yaw, velocity, landed=False, response_prior=self.prior
        )

    def fly(self, command):
        c, s = (1.0, 0.0) if self.turning else (cos(self.yaw), sin(self.yaw))
        forward, left = command.forward_m_s, command.left_m_s
        self.waiting.append(
            (c * forward - s * left, s * forward + c * left, command.up_m_s, command.yaw_rate_rad_s)
        )
        kept = exp(-STEP_S / self.lag_s)
        self.speeds = [
            v + (1.0 - kept) * (u - v) for v, u in zip(self.speeds, self.waiting.popleft(), strict=True)
        ]
        if self.own_lag_s:
            self._follow_itself()
        self.position = [
            x + v * STEP_S for x, v in zip(self.position, self.state.velocity_arena_m_s, strict=True)
        ]
        self.yaw = remainder(self.yaw + self.speeds[3] * STEP_S, 2 * pi)
        self.ticks += 1

    def _follow_itself(self):
        """The second lag: a velocity that stays the same turns with the heading."""
        kept = exp(-STEP_S / self.own_lag_s)
        turn = self.speeds[3] * STEP_S
        c, s, (x, y) = cos(turn), sin(turn), self.own
        x, y = c * x - s * y, s * x + c * y
        self.own = (
            self.speeds[0] + kept * (x - self.speeds[0]),
            self.speeds[1] + kept * (y - self.speeds[1]),
        )


class PiVehicle(Vehicle):
    """In plan a velocity loop with PX4's proportional and integral gains against drag, in arena axes."""

    def __init__(self, dead_s, drag_per_s):
        super().__init__(dead_s, 0.4)
        self.drag_per_s = drag_per_s
        self.plan, self.integral_m_s2 = [0.0, 0.0], [0.0, 0.0]

    @property
    def state(self):
        return replace(super().state, velocity_arena_m_s=(*self.plan, self.speeds[2]))

    def fly(self, command):
        coming = self.waiting[0][:2]
        for axis, wanted in enumerate(coming):
            for _ in range(10):
                off = wanted - self.plan[axis]
                self.integral_m_s2[axis] += 0.4 * off * STEP_S / 10
                change = 1.8 * off + self.integral_m_s2[axis] - self.drag_per_s * self.plan[axis]
                self.plan[axis] += change * STEP_S / 10
        super().fly(command)


def command_at(time_s):
    """Starts, stops, turns and climbs, as of a flight."""
    quarter = int(time_s / 1.5) % 4
    return VelocityFluCommand(
        (0.8, 0.8, 0.0, -0.5)[quarter],
        (0.0, 0.4, -0.4, 0.0)[quarter],
        (0.4, 0.0, -0.4, 0.0)[quarter],
        (0.6, 0.0, -0.8, 0.5)[quarter],
    )


def learn(vehicle, seconds=15.0):
    estimate, sent = ResponseEstimate(), None
    for tick in range(round(seconds / STEP_S)):
        estimate.update(vehicle.state, sent)
        sent = command_at(tick * STEP_S)
        vehicle.fly(sent)
    estimate.update(vehicle.state, sent)
    return estimate


@pytest.mark.parametrize(("dead_s", "lag_s"), [(0.15, 0.6), (0.35, 0.45), (0.55, 0.8)])
@pytest.mark.parametrize("turning", [False, True])
def test_dead_time_lag_and_axes_are_learnt(dead_s, lag_s, turning):
    response = learn(Vehicle(dead_s, lag_s, turning=turning)).response
    assert response.late
    assert response.turning is turning
    for dead, lag in (
        (response.level_dead_s, response.level_lag_s),
        (response.climb_dead_s, response.climb_lag_s),
        (response.yaw_dead_s, response.yaw_lag_s),
    ):
        assert (dead, lag) == pytest.approx((dead_s, lag_s), abs=0.001)


def test_a_vehicle_that_answers_in_time_is_not_late():
    estimate = learn(Vehicle(0.05, 0.15, turning=True))
    assert not estimate.response.late


@pytest.mark.parametrize(("prior", "level_s"), [(ResponsePrior.LATE, 0.45), (ResponsePrior.UNKNOWN, 0.65)])
def test_a_vehicle_that_is_known_to_be_another_is_late_from_the_first_tick_on(prior, level_s):
    estimate = ResponseEstimate()
    estimate.update(Vehicle(0.05, 0.15, prior=prior).state, None)
    assert estimate.response.late
    assert estimate.response.level_s == pytest.approx(level_s)


def test_one_that_was_taken_for_late_and_is_not_is_known_after_some_seconds():
    response = learn(Vehicle(0.05, 0.15, prior=ResponsePrior.LATE)).response
    assert response.late  # its loops are not known, so its motion is still predicted
    assert response.level_dead_s + response.level_lag_s == pytest.approx(0.2)


def test_near_a_gate_a_model_that_has_been_known_for_some_time_is_kept():
    vehicle, estimate, sent = Vehicle(0.15, 0.3, prior=ResponsePrior.LATE), ResponseEstimate(), None
    for tick in range(round(30.0 / STEP_S)):
        time_s = tick * STEP_S
        if time_s == 8.0:
            vehicle.lag_s, known = 0.8, estimate.response
        estimate.update(vehicle.state, sent, near_gate=8.0 <= time_s < 20.0)
        assert not 8.0 <= time_s < 20.0 or estimate.response == known
        sent = command_at(time_s)
        vehicle.fly(sent)
    assert estimate.response.level_s > known.level_s


def test_slow_flight_shows_the_lag_of_a_vehicle_that_is_known_to_be_late():
    vehicle, estimate, sent = Vehicle(0.35, 0.6), ResponseEstimate(), None
    for tick in range(round(7.0 / STEP_S)):
        estimate.update(vehicle.state, sent)
        usual = command_at(tick * STEP_S)
        sent = VelocityFluCommand(
            usual.forward_m_s / 5, usual.left_m_s / 5, usual.up_m_s, usual.yaw_rate_rad_s
        )
        vehicle.fly(sent)
    assert estimate.response.late
    assert (estimate.response.level_dead_s, estimate.response.level_lag_s) == pytest.approx((0.35, 0.6))
    assert not estimate.response.turning


def test_a_second_lag_is_learnt():
    response = learn(Vehicle(0.15, 0.6, own_lag_s=0.4), 25.0).response
    assert response.own_lag_s == 0.4
    assert response.level_dead_s == pytest.approx(0.15, abs=0.001)
    assert response.level_lag_s == pytest.approx(0.6, abs=0.001)


@pytest.mark.parametrize(("drag_per_s", "share"), [(1.0, 0.64), (0.4, 0.82)])
def test_the_share_that_a_velocity_loop_against_drag_follows_soon_is_learnt(drag_per_s, share):
    response = learn(PiVehicle(0.25, drag_per_s), 30.0).response
    assert response.share == pytest.approx(share, abs=0.06)
    assert response.level_dead_s + response.level_lag_s == pytest.approx(0.25 + share / 1.8, abs=0.1)


@pytest.mark.parametrize("own_lag_s", [0.0, 0.4])
def test_a_vehicle_that_follows_all_of_a_command_has_no_share(own_lag_s):
    assert learn(Vehicle(0.35, 0.6, own_lag_s=own_lag_s), 30.0).response.share == 1.0


def test_what_a_leg_leaves_in_the_integral_is_predicted():
    vehicle, sent = PiVehicle(0.35, 1.0), VelocityFluCommand(0.0, 0.8)
    estimate = learn(vehicle, 25.0)
    for _ in range(80):
        vehicle.fly(sent)
        estimate.update(vehicle.state, sent)
    for _ in range(20):
        vehicle.fly(VelocityFluCommand())
        estimate.update(vehicle.state, VelocityFluCommand())
    prediction, before = estimate.predict(), vehicle.position
    left = prediction.slow_m_s[1] * cos(vehicle.yaw) - prediction.slow_m_s[0] * sin(vehicle.yaw)
    assert left > 0.06
    assert hypot(*prediction.disturbance_m_s[:2]) < 0.05
    for _ in range(7):
        vehicle.fly(VelocityFluCommand())
    moved = [b - a for a, b in zip(before, vehicle.position, strict=True)]
    assert prediction.moved_m == pytest.approx(moved, abs=0.01)


@pytest.mark.parametrize("own_lag_s", [0.0, 0.4])
def test_the_motion_by_commands_on_their_way_is_predicted(own_lag_s):
    vehicle = Vehicle(0.35, 0.6, drift_m_s=0.05, own_lag_s=own_lag_s)
    estimate = learn(vehicle, 20.0)
    prediction, before = estimate.predict(), vehicle.position
    for _ in range(7):
        vehicle.fly(VelocityFluCommand())
    moved = [b - a for a, b in zip(before, vehicle.position, strict=True)]
    missed = hypot(*(p - m for p, m in zip(prediction.moved_m, moved, strict=True)))
    assert hypot(*moved) > 0.1
    assert missed < 0.01
    assert prediction.velocity_m_s == pytest.approx(vehicle.state.velocity_arena_m_s, abs=0.03)
    assert prediction.disturbance_m_s[2] == pytest.approx(0.05, abs=0.01)
