"""The x500 at speed (large tilt, turns, climbs, unknown forces, recoveries), and the disturbance observer."""

from math import cos, degrees, dist, exp, hypot, radians, sin

import pytest

from firmware_py.commands import BodyRateCommand, VelocityFrdCommand
from firmware_py.control.vector_law import DisturbanceObserver
from framerunner.vehicle.airframe import load_airframe
from tests.flight import PERIOD_S, Hover

X500 = load_airframe("x500")


def rise_s(samples, field, target):
    start_s = samples[0].time_s
    first = getattr(samples[0], field)
    return next(
        (s.time_s - start_s for s in samples if (getattr(s, field) - first) / (target - first) >= 0.9), None
    )


def height_span_m(samples):
    heights = [-sample.position_ned_m[2] for sample in samples]
    return min(heights) - heights[0], max(heights) - heights[0]


@pytest.fixture
def hover():
    flight = Hover(X500, height_m=60.0)
    flight.fly(2.0, VelocityFrdCommand())
    return flight


@pytest.mark.parametrize(
    ("field", "target", "command", "limit_s"),
    [
        ("forward_m_s", 1.0, VelocityFrdCommand((1.0, 0.0, 0.0)), 0.8),
        ("right_m_s", -1.0, VelocityFrdCommand((0.0, -1.0, 0.0)), 0.8),
        ("down_m_s", -3.0, VelocityFrdCommand((0.0, 0.0, -3.0)), 0.7),
        ("down_m_s", 1.5, VelocityFrdCommand((0.0, 0.0, 1.5)), 0.6),
        ("yaw_rate_rad_s", 1.57, VelocityFrdCommand(yaw_rate_rad_s=1.57), 0.6),
    ],
)
def test_step_response(hover, field, target, command, limit_s):
    samples = hover.fly(4.0, command)
    assert rise_s(samples, field, target) < limit_s
    assert max(getattr(sample, field) / target for sample in samples) < 1.02
    assert getattr(samples[-1], field) == pytest.approx(target, rel=0.002)


@pytest.mark.parametrize(("field", "velocity"), [("forward_m_s", (12, 0, 0)), ("right_m_s", (0, 12, 0))])
def test_to_twelve_metres_a_second_and_back(hover, field, velocity):
    faster = hover.fly(5.0, VelocityFrdCommand(velocity))
    slower = hover.fly(5.0, VelocityFrdCommand())
    assert rise_s(faster, field, 12.0) < 1.5
    assert rise_s(slower, field, 0.0) < 1.5
    assert max(getattr(sample, field) for sample in faster) < 12.1
    assert min(getattr(sample, field) for sample in slower) > -0.1
    for samples in (faster, slower):
        lowest, highest = height_span_m(samples)
        assert lowest > -0.1
        assert highest < 0.1
    # Both tilts use what the airframe allows, and no more.
    assert radians(43) < max(sample.tilt_rad for sample in faster) < radians(46)


def test_a_diagonal_climb_keeps_the_vertical_velocity(hover):
    samples = hover.fly(4.0, VelocityFrdCommand((8.0, 4.0, -3.0)))
    assert rise_s(samples, "down_m_s", -3.0) < 0.8
    assert samples[-1].forward_m_s == pytest.approx(8.0, abs=0.05)
    assert samples[-1].right_m_s == pytest.approx(4.0, abs=0.05)
    assert samples[-1].down_m_s == pytest.approx(-3.0, abs=0.02)


def test_a_velocity_in_ned_is_kept_while_yawing(hover):
    def eastwards(yaw_rate_rad_s):
        return lambda state: VelocityFrdCommand(
            (12 * sin(state.yaw_rad), 12 * cos(state.yaw_rad), 0.0), yaw_rate_rad_s
        )

    hover.fly(4.0, eastwards(0.0))
    for sample in hover.fly(6.0, eastwards(radians(90))):
        north, east, _ = sample.state.velocity_ned_m_s
        assert abs(north) < 0.3
        assert east == pytest.approx(12.0, abs=0.3)
    assert degrees(hover.samples[-1].yaw_rate_rad_s) == pytest.approx(90.0, rel=0.05)


@pytest.mark.parametrize(("speed", "turn_deg_s"), [(5.0, 60.0), (10.0, -30.0)])
def test_a_velocity_in_level_axes_turns_with_them(hover, speed, turn_deg_s):
    hover.fly(3.0, VelocityFrdCommand((speed, 0.0, 0.0)))
    turning = hover.fly(5.0, VelocityFrdCommand((speed, 0.0, 0.0), radians(turn_deg_s)))
    assert max(abs(sample.right_m_s) for sample in turning) < 0.9
    assert turning[-1].forward_m_s == pytest.approx(speed, abs=0.02)
    assert turning[-1].right_m_s == pytest.approx(0.0, abs=0.02)


def test_an_unknown_force_and_moment_are_learnt_and_unlearnt(hover):
    hover.dynamics.push((4.0, -2.0, -3.0), (0.05, 0.1, 0.02))
    pushed = hover.fly(5.0, VelocityFrdCommand())
    assert hypot(*pushed[-1].state.velocity_ned_m_s) < 0.02
    assert pushed[-1].tilt_rad > radians(10)  # tilted against the force
    hover.dynamics.push((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    freed = hover.fly(5.0, VelocityFrdCommand())
    assert hypot(*freed[-1].state.velocity_ned_m_s) < 0.02
    assert freed[-1].tilt_rad < radians(0.5)


def test_an_unreachable_speed_winds_nothing_up(hover):
    hover.stabiliser.limits.limit_tilt(radians(10))
    cruise = hover.fly(8.0, VelocityFrdCommand((20.0, 0.0, 0.0)))
    assert max(sample.tilt_rad for sample in cruise) < radians(11)
    assert cruise[-1].forward_m_s < 12.0
    hover.stabiliser.limits.limit_tilt(radians(90))  # no more than the airframe's own 45 degrees
    stop = hover.fly(4.0, VelocityFrdCommand())
    assert max(sample.tilt_rad for sample in stop) < radians(46)
    assert min(sample.forward_m_s for sample in stop) > -0.1
    assert abs(stop[-1].forward_m_s) < 0.02


@pytest.mark.parametrize(("tilt_deg", "loss_m"), [(60, 1.0), (90, 3.5)])
@pytest.mark.parametrize("axis", [(6.0, 0.0, 0.0), (0.0, -6.0, 0.0), (4.0, 4.0, 1.0)])
def test_recovers_from_a_large_tilt(hover, tilt_deg, loss_m, axis):
    while hover.samples[-1].state.attitude is not None:
        _, x, y, _ = hover.fly(0.004, BodyRateCommand(axis, 0.6))[-1].state.attitude
        if 1.0 - 2.0 * (x * x + y * y) < cos(radians(tilt_deg)):
            break
    recovery = hover.fly(4.0, VelocityFrdCommand())
    assert height_span_m(recovery)[0] > -loss_m
    assert recovery[-1].tilt_rad < radians(1)
    assert hypot(*recovery[-1].state.velocity_ned_m_s) < 0.05


def test_ten_seconds_of_hover_drift_less_than_two_centimetres(hover):
    samples = hover.fly(10.0, VelocityFrdCommand())
    assert max(dist(samples[0].position_ned_m, sample.position_ned_m) for sample in samples) < 0.02
    assert samples[-1].output.throttle == pytest.approx(0.592, abs=0.002)  # near PX4's MPC_THR_HOVER, 0.6


def learn(observer, push, seconds, *, known=0.0, velocity=0.0):
    for _ in range(round(seconds / PERIOD_S)):
        observer.correct((velocity, -velocity, 0.0))
        observer.predict(known, -known, 0.0)
        velocity += (push + known) * PERIOD_S
    return velocity


def test_learns_a_constant_disturbance_with_a_double_pole():
    observer = DisturbanceObserver(2.0, PERIOD_S, 10.0)
    learn(observer, 3.0, 1.0)
    expected = 3.0 * (1 - exp(-2.0) * (1 + 2.0))
    assert observer.d[0] == pytest.approx(expected, rel=0.02)
    assert observer.d[1] == pytest.approx(-expected, rel=0.02)
    assert observer.d[2] == 0.0


def test_an_expected_acceleration_is_not_learnt():
    observer = DisturbanceObserver(2.0, PERIOD_S, 10.0)
    learn(observer, 0.0, 2.0, known=5.0)
    assert observer.d == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_starts_at_any_velocity_without_a_jump():
    observer = DisturbanceObserver(2.0, PERIOD_S, 10.0)
    learn(observer, 0.0, 0.1, velocity=12.0)
    assert observer.d == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)


def test_the_estimate_is_limited():
    observer = DisturbanceObserver(2.0, PERIOD_S, 1.0)
    learn(observer, 8.0, 3.0)
    assert observer.d == (1.0, -1.0, 0.0)


def test_while_held_it_learns_and_forgets_nothing():
    observer = DisturbanceObserver(2.0, PERIOD_S, 10.0)
    velocity = learn(observer, 3.0, 3.0)
    before = observer.d
    for _ in range(250):
        observer.hold((velocity, -velocity, 0.0))
    observer.correct((velocity, -velocity, 0.0))
    assert observer.d == before
    observer.reset()
    assert observer.d == (0.0, 0.0, 0.0)


def test_a_descent_faster_than_a_fall_keeps_it_upright():
    """Without a least thrust, MPC_THR_MIN 0, the desired thrust is zero and has no direction."""
    hover = Hover(X500, height_m=60.0)
    hover.fly(1.0, VelocityFrdCommand((3.0, 0.0, 0.0)))
    falling = hover.fly(0.5, VelocityFrdCommand((0.0, 0.0, 8.0)))
    assert min(sample.output.throttle for sample in falling) < 0.05
    assert falling[-1].tilt_rad < 0.1
