"""The error-state covariance against filterpy's Kalman filter, step by step."""

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter

from firmware_py.estimation.error_state import (
    ACCEL_BIAS,
    ATTITUDE,
    GYRO_BIAS,
    INERTIAL_STATES,
    POSITION,
    VELOCITY,
    Drift,
    ErrorCovariance,
)
from firmware_py.estimation.joint_update import JointUpdate
from framerunner.geometry.rotations import quaternion_from_euler, rotation

DRIFTS = (Drift(), Drift(0.3), Drift(0.2, 5.0))
SIZE = INERTIAL_STATES + len(DRIFTS)
PERIOD_S = 0.02
TURN, PUSH, GYRO, ACCEL = 4e-8, 6e-5, 1e-9, 3e-8


def fuse(covariance, rows, innovations, variances):
    """Fuse measured numbers; return their normalised innovation squared."""
    update = JointUpdate(covariance, rows, innovations)
    nis = sum(update.fuse(index, variance) for index, variance in enumerate(variances))
    update.apply()
    return nis


def reference_matrices(attitude, push):
    """F and Q of the model, written out with matrices."""
    turn = np.array(rotation(attitude)).reshape(3, 3)
    n, e, d = push
    cross = np.array([[0.0, -d, e], [d, 0.0, -n], [-e, n, 0.0]])
    f = np.eye(SIZE)
    at = {
        name: slice(index, index + 3)
        for name, index in {
            "t": ATTITUDE,
            "v": VELOCITY,
            "p": POSITION,
            "g": GYRO_BIAS,
            "a": ACCEL_BIAS,
        }.items()
    }
    f[at["t"], at["g"]] = -turn * PERIOD_S
    f[at["v"], at["t"]] = -cross
    f[at["v"], at["a"]] = -turn * PERIOD_S
    f[at["p"], at["v"]] = np.eye(3) * PERIOD_S
    f[at["p"], at["t"]] = -cross * PERIOD_S / 2
    f[at["p"], at["a"]] = -turn * PERIOD_S**2 / 2
    f[-1, -1] = np.exp(-PERIOD_S / 5.0)
    q = np.zeros(SIZE)
    q[0:3], q[3:6], q[9:12], q[12:15] = TURN, PUSH, GYRO, ACCEL
    q[-2] = 0.3**2 * PERIOD_S
    q[-1] = 0.2**2 * 5.0 / 2 * (1 - np.exp(-2 * PERIOD_S / 5.0))
    return f, np.diag(q)


def test_each_prediction_and_correction_equals_filterpys():
    numbers = np.random.default_rng(3)
    ours, theirs = ErrorCovariance(DRIFTS), KalmanFilter(SIZE, 1)
    start = numbers.normal(size=(SIZE, SIZE)) * 0.1
    ours.p[:] = theirs.P = start @ start.T
    theirs.x = np.zeros((SIZE, 1))
    for step in range(200):
        attitude = quaternion_from_euler(*numbers.normal(0.0, 0.5, 3))
        push = tuple(numbers.normal((0.0, 0.0, -0.2), 0.1))
        f, q = reference_matrices(attitude, push)
        ours.predict(
            rotation(attitude),
            push,
            PERIOD_S,
            turn_frd_rad=(0.0, 0.0, 0.0),
            push_frd_m_s=push,
            turn_variance_rad2=TURN,
            push_variance_m2_s2=PUSH,
            gyro_bias_variance=GYRO,
            accel_bias_variance=ACCEL,
        )
        theirs.P = f @ theirs.P @ f.T + q
        np.testing.assert_allclose(ours.p, theirs.P, rtol=1e-9, atol=1e-12)
        # Two numbers at once: the second is measured against a nominal state that does not know the first.
        theirs.x[:] = 0.0
        nis = 0.0
        for index, innovation in ((POSITION + step % 3, numbers.normal()), (SIZE - 1, numbers.normal())):
            row = np.zeros((1, SIZE))
            row[0, index] = 1.0
            if index == SIZE - 1:
                row[0] = numbers.normal(size=SIZE)
                nis += fuse(ours, row, [innovation], [0.04])
            else:
                nis += ours.fuse_state(index, innovation, 0.04)
            theirs.update(np.array([[innovation]]), R=np.array([[0.04]]), H=row)
        np.testing.assert_allclose(ours.take_error(), theirs.x[:, 0], rtol=1e-7, atol=1e-10)
        np.testing.assert_allclose(ours.p, theirs.P, rtol=1e-7, atol=1e-10)
        assert nis > 0.0
        ours.symmetrise()
        theirs.P = ours.p.copy()
    assert not any(ours.take_error())


def test_numbers_fused_at_once_correct_as_a_kalman_filter_does():
    numbers = np.random.default_rng(7)
    start = numbers.normal(size=(SIZE, SIZE))
    for count in (1, 2, 4):
        ours, theirs = ErrorCovariance(DRIFTS), KalmanFilter(SIZE, count)
        ours.p[:] = theirs.P = start @ start.T
        theirs.x = np.zeros((SIZE, 1))
        rows, innovations = numbers.normal(size=(count, SIZE)), numbers.normal(size=count)
        variances = numbers.uniform(0.1, 1.0, count)
        fuse(ours, rows, innovations.tolist(), variances.tolist())
        theirs.update(innovations[:, None], R=np.diag(variances), H=rows)
        np.testing.assert_allclose(ours.p, theirs.P, rtol=1e-8, atol=1e-9)
        np.testing.assert_allclose(ours.take_error(), theirs.x[:, 0], rtol=1e-8, atol=1e-9)


def test_a_number_that_is_not_fused_changes_nothing():
    numbers = np.random.default_rng(8)
    start, rows = numbers.normal(size=(15, 15)), numbers.normal(size=(3, 15))
    some, only = ErrorCovariance(), ErrorCovariance()
    some.p[:] = only.p[:] = start @ start.T
    update = JointUpdate(some, rows, [0.3, float("nan"), -0.2])
    update.fuse(0, 0.5)
    update.fuse(2, 0.5)
    update.apply()
    fuse(only, rows[[0, 2]], [0.3, -0.2], [0.5, 0.5])
    np.testing.assert_allclose(some.p, only.p, rtol=1e-12)
    np.testing.assert_allclose(some.take_error(), only.take_error(), rtol=1e-12)


def test_the_nis_of_sequential_numbers_is_that_of_the_whole_measurement():
    numbers = np.random.default_rng(5)
    covariance = ErrorCovariance()
    start = numbers.normal(size=(15, 15))
    covariance.p[:] = start @ start.T
    rows, innovation = numbers.normal(size=(3, 15)), numbers.normal(size=3)
    whole = rows @ covariance.p @ rows.T + np.eye(3) * 0.5
    expected = innovation @ np.linalg.solve(whole, innovation)
    nis = fuse(covariance, rows, innovation.tolist(), [0.5] * 3)
    assert nis == pytest.approx(expected)


def test_a_considered_state_keeps_its_variance_and_value_but_counts():
    plain, considering = ErrorCovariance((Drift(),)), ErrorCovariance((Drift(),), considered=1)
    row = np.zeros(16)
    row[POSITION] = row[15] = 1.0
    for covariance in (plain, considering):
        covariance.set_variance(POSITION, 1.0)
        covariance.set_variance(15, 0.25)
        for _ in range(50):
            fuse(covariance, row[None, :], [0.1], [0.01])
    assert considering.p[15, 15] == 0.25
    assert considering.take_error()[15] == 0.0
    # The position cannot become better known than the place at which it is measured.
    assert considering.p[POSITION, POSITION] == pytest.approx(0.25, rel=0.25)
    assert considering.p[POSITION, POSITION] >= 0.2


def test_a_random_walk_and_a_gauss_markov_process_grow_as_they_should():
    assert Drift(0.5).over(4.0) == pytest.approx((1.0, 1.0))
    kept, added = Drift(0.2, 3.0).over(1000.0)
    assert kept == pytest.approx(0.0, abs=1e-9)
    assert added == pytest.approx(0.2**2 * 3.0 / 2)
