"""The linear model and the regulator, checked against python-control and against the published design."""

import control
import numpy as np
import pytest

from firmware_py.control.design import (
    cost_matrices,
    design,
    design_bandwidths,
    discretise,
    hover_model,
    with_integrals,
)
from firmware_py.control.mixer import allocation
from framerunner.vehicle.airframe import GRAVITY_M_S2, load_airframe

PERIOD_S = 0.004


@pytest.fixture(scope="module")
def airframe():
    return load_airframe("abejorro")


def test_gains_agree_with_python_control(airframe):
    a, b = with_integrals(discretise(hover_model(airframe), PERIOD_S), PERIOD_S)
    q, r = cost_matrices(airframe)
    expected, _, poles = control.dlqr(a, b, q, r)
    gains = design(airframe, PERIOD_S)
    np.testing.assert_allclose(np.hstack([gains.kx, gains.ki]), expected, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(np.sort_complex(gains.poles), np.sort_complex(poles), rtol=1e-5, atol=1e-6)


def test_closed_loop_is_stable_with_margin(airframe):
    poles = design(airframe, PERIOD_S).poles
    slowest_s = -PERIOD_S / np.log(np.max(np.abs(poles)))
    assert np.max(np.abs(poles)) < 1.0
    assert slowest_s < 2.0


def test_closed_loop_stays_stable_with_the_motor_lag_that_the_design_leaves_out(airframe):
    model = hover_model(airframe)
    lag = airframe.motor.time_constant_s
    a = np.block([[model.a, model.b], [np.zeros((4, 8)), -np.eye(4) / lag]])
    b = np.vstack([np.zeros((8, 4)), np.eye(4) / lag])
    lagging = control.c2d(control.ss(a, b, np.eye(12), 0), PERIOD_S)
    gains = design(airframe, PERIOD_S)
    outputs = np.hstack([model.c, np.zeros((4, 4))])
    loop = np.block(
        [
            [lagging.A - lagging.B @ np.hstack([gains.kx, np.zeros((4, 4))]), -lagging.B @ gains.ki],
            [outputs * PERIOD_S, np.eye(4)],
        ]
    )
    assert np.max(np.abs(np.linalg.eigvals(loop))) < 0.999


def test_discretisation_is_the_exact_zero_order_hold(airframe):
    model = hover_model(airframe)
    expected = control.c2d(control.ss(model.a, model.b, model.c, 0), PERIOD_S, method="zoh")
    exact = discretise(model, PERIOD_S)
    np.testing.assert_allclose(exact.a, expected.A, atol=1e-12)
    np.testing.assert_allclose(exact.b, expected.B, atol=1e-12)


def test_the_hover_model_has_the_right_signs_and_sizes(airframe):
    model = hover_model(airframe)
    state = np.zeros(8)
    state[1] = -0.1  # nose down
    assert (model.a @ state)[5] == pytest.approx(0.1 * GRAVITY_M_S2)
    state = np.zeros(8)
    state[0] = 0.1  # right side down
    assert (model.a @ state)[6] == pytest.approx(0.1 * GRAVITY_M_S2)
    more_thrust = model.b @ np.array([0.3, 0, 0, 0])
    assert more_thrust[7] == pytest.approx(-1.0)  # 0.3 N on 0.3 kg, upwards


def test_allocation_uses_the_true_arms(airframe):
    matrix = allocation(airframe)
    hover = np.full(4, airframe.hover_speed_rad_s**2)
    np.testing.assert_allclose(matrix @ hover, [airframe.weight_n, 0, 0, 0], atol=1e-12)
    front_right_only = matrix @ np.array([1e6, 0, 0, 0])
    thrust = 3.9718  # N at 1000 rad/s
    np.testing.assert_allclose(
        front_right_only, [thrust, -0.075 * thrust, 0.075 * thrust, -0.13581], rtol=1e-9
    )


def test_the_published_gains_are_a_design_for_the_true_arm(airframe):
    """The paper's state feedback on the model with 0.075 m arms has its poles at -6 to -9 (facts of [C])."""
    kx = np.array(  # rows NE NW SE SW, columns roll pitch p q r forward left up (forward-left-up axes)
        [
            [-334.1327, -334.1327, -29.9223, -29.9223, 72.7456, -167.9315, 167.9315, 373.1147],
            [334.1327, -334.1327, 29.9223, -29.9223, -72.7456, -167.9315, -167.9315, 373.1147],
            [-334.1327, 334.1327, -29.9223, 29.9223, -72.7456, 167.9315, 167.9315, 373.1147],
            [334.1327, 334.1327, 29.9223, 29.9223, 72.7456, 167.9315, -167.9315, 373.1147],
        ]
    )
    ky = 1000 * np.array(
        [
            [-0.3078, 0.3078, 1.5803, 0.3081],
            [-0.3078, -0.3078, 1.5803, -0.3081],
            [0.3078, 0.3078, 1.5803, -0.3081],
            [0.3078, -0.3078, 1.5803, 0.3081],
        ]
    )
    to_ours = np.diag([1, -1, 1, -1, -1, 1, -1, -1.0])  # FRD to FLU
    model = hover_model(airframe)
    hover = airframe.hover_speed_rad_s
    per_speed = allocation(airframe) * 2 * hover  # columns FR RL FL RR
    per_speed = per_speed[:, [0, 2, 3, 1]]  # NE NW SE SW
    outputs_ours = np.diag([1, -1, -1, -1.0])
    a = np.block([[model.a, np.zeros((8, 4))], [model.c, np.zeros((4, 4))]])
    b = np.vstack([model.b @ per_speed, np.zeros((4, 4))])
    poles = np.linalg.eigvals(a - b @ np.hstack([kx @ to_ours, ky @ outputs_ours]))
    assert np.max(np.abs(poles.imag)) < 2.0
    assert -10.0 < np.min(poles.real) < -7.5
    assert -7.0 < np.max(poles.real) < -4.5


@pytest.mark.parametrize("scale", [0.3, 1.0, 4.0])
def test_a_scaled_airframe_has_the_same_poles(airframe, scale):
    motor = airframe.motor.model_copy(
        update={
            "thrust_n_s2": airframe.motor.thrust_n_s2 * scale,
            "torque_nm_s2": airframe.motor.torque_nm_s2 * scale,
        }
    )
    scaled = airframe.model_copy(
        update={
            "mass_kg": airframe.mass_kg * scale,
            "inertia_kg_m2": tuple(value * scale for value in airframe.inertia_kg_m2),
            "motor": motor,
        }
    )
    np.testing.assert_allclose(
        np.sort(np.abs(design(scaled, PERIOD_S).poles)),
        np.sort(np.abs(design(airframe, PERIOD_S).poles)),
        rtol=1e-6,
    )


@pytest.fixture(scope="module", params=["abejorro", "racer-3in", "x500"])
def any_airframe(request):
    return load_airframe(request.param)


def test_bandwidths_agree_with_python_control(any_airframe):
    model = discretise(hover_model(any_airframe), PERIOD_S)
    q, r = cost_matrices(any_airframe)
    k, _, poles = control.dlqr(model.a, model.b, q[:8, :8], r)
    loops = design_bandwidths(any_airframe, PERIOD_S)
    i_roll, i_pitch, i_yaw = any_airframe.inertia_kg_m2
    forward, right, down = loops.velocity_level
    roll, pitch = loops.attitude
    p, q_rate, yaw = loops.rate
    expected = np.zeros((4, 8))
    expected[0, 7] = -down * any_airframe.mass_kg
    expected[1, [0, 2, 6]] = i_roll * p * np.array([roll, 1.0, roll * right / GRAVITY_M_S2])
    expected[2, [1, 3, 5]] = i_pitch * q_rate * np.array([pitch, 1.0, -pitch * forward / GRAVITY_M_S2])
    expected[3, 4] = i_yaw * yaw
    np.testing.assert_allclose(k, expected, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(np.sort(np.abs(loops.poles)), np.sort(np.abs(poles)), rtol=1e-6)


def roll_loop(airframe, lag_s):
    """Open loop of the nested design from the roll moment's error to itself, with the motors' lag."""
    loops = design_bandwidths(airframe, PERIOD_S)
    rate, attitude, velocity = loops.rate[0], loops.attitude[0], loops.velocity_level[1]
    s = control.tf("s")
    motor = 1 / (lag_s * s + 1)
    hold = control.tf(*control.pade(1.5 * PERIOD_S, 2))  # a sample's age and the hold, on average
    feedback = rate * (1 + attitude * (1 + velocity / s) / s)
    plant = 1 / s
    return hold * motor * feedback * plant


@pytest.mark.parametrize(
    ("name", "least_deg"), [("abejorro", 20.0), ("racer-3in", 20.0), ("x500", 40.0)]
)  # its drag not counted
def test_nested_loops_keep_a_margin_with_lag_and_sampling(name, least_deg):
    airframe = load_airframe(name)
    loop = roll_loop(airframe, airframe.motor.time_constant_s)
    gains, phases_deg, _, _, _, _ = control.stability_margins(loop, returnall=True)
    assert all(gain > 1.9 or gain < 0.5 for gain in gains if gain > 0)
    assert np.min(np.abs(phases_deg)) > least_deg


def test_the_x500_yaws_within_what_its_rotors_can_turn():
    x500 = load_airframe("x500")
    hover, full = x500.hover_speed_rad_s**2, x500.motor.max_speed_rad_s**2
    at_hover = 4 * x500.motor.torque_nm_s2 * (full - hover) / x500.inertia_kg_m2[2]
    assert at_hover == pytest.approx(5.1, abs=0.3)
    asked = design_bandwidths(x500, PERIOD_S).rate[2] * x500.limits.yaw_rate_rad_s
    assert asked < 4 * at_hover  # a full step saturates, but not by so much that it takes long to leave
