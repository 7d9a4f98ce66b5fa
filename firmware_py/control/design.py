"""Design of the stabiliser: linear-quadratic regulators on the multicopter's linear model at hover.

States x = [roll, pitch, p, q, r, v_forward, v_right, v_down] (level axes that turn with the yaw), inputs
u = [thrust beyond weight N, roll moment, pitch moment, yaw moment N m] in body FRD, outputs
y = [v_forward, v_right, v_down, r]. Quadratic drag vanishes at hover. Source of the equations: Newton-Euler
at small angles, as in Casado & Bermúdez, Electronics 2021, 10, 7, section 3, in FRD instead of FLU axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm, solve_discrete_are

from framerunner.vehicle.airframe import GRAVITY_M_S2, Airframe

Array = npt.NDArray[np.float64]

_DESIGNS_KEPT = 8  # a design takes ten milliseconds, and many flights are of one airframe


@dataclass(frozen=True, slots=True)
class LinearModel:
    """x' = A x + B u, y = C x (continuous), or x+ = A x + B u (discrete).

    Attributes:
        a: shape (8, 8).
        b: shape (8, 4).
        c: shape (4, 8).
    """

    a: Array
    b: Array
    c: Array


def hover_model(airframe: Airframe) -> LinearModel:
    """Return the continuous model of an airframe at hover."""
    i_roll, i_pitch, i_yaw = airframe.inertia_kg_m2
    a = np.zeros((8, 8))
    a[0, 2] = a[1, 3] = 1.0
    a[5, 1] = -GRAVITY_M_S2  # nose up slows down
    a[6, 0] = GRAVITY_M_S2  # right side down accelerates right
    b = np.zeros((8, 4))
    b[2, 1], b[3, 2], b[4, 3] = 1 / i_roll, 1 / i_pitch, 1 / i_yaw
    b[7, 0] = -1 / airframe.mass_kg
    c = np.zeros((4, 8))
    c[0, 5] = c[1, 6] = c[2, 7] = c[3, 4] = 1.0
    return LinearModel(a, b, c)


def discretise(model: LinearModel, period_s: float) -> LinearModel:
    """Return the exact model at sampling instants, for inputs held constant between them.

    The block exponential of Van Loan, "Computing integrals involving the matrix exponential", 1978.
    """
    states, inputs = model.b.shape
    block = np.zeros((states + inputs, states + inputs))
    block[:states, :states], block[:states, states:] = model.a, model.b
    power = expm(block * period_s)
    return LinearModel(power[:states, :states], power[:states, states:], model.c)


def with_integrals(model: LinearModel, period_s: float) -> tuple[Array, Array]:
    """Augment a discrete model (n states, m outputs) with the integrals of its outputs.

    Returns:
        A of shape (n + m, n + m) and B of shape (n + m, inputs) for [x, sum of y * period].
    """
    states, inputs = model.b.shape
    outputs = model.c.shape[0]
    a = np.zeros((states + outputs, states + outputs))
    a[:states, :states] = model.a
    a[states:, :states] = model.c * period_s
    a[states:, states:] = np.eye(outputs)
    b = np.zeros((states + outputs, inputs))
    b[:states] = model.b
    return a, b


def cost_matrices(airframe: Airframe) -> tuple[Array, Array]:
    """Return Q of shape (12, 12) and R of shape (4, 4) of the quadratic cost, from the airframe's weights."""
    w = airframe.stabiliser
    states = [
        w.tilt_rad,
        w.tilt_rad,
        w.roll_pitch_rate_rad_s,
        w.roll_pitch_rate_rad_s,
        w.yaw_rate_rad_s,
        w.velocity_horizontal_m_s,
        w.velocity_horizontal_m_s,
        w.velocity_vertical_m_s,
        w.integral_horizontal_m,
        w.integral_horizontal_m,
        w.integral_vertical_m,
        w.integral_yaw_rad,
    ]
    i_roll, i_pitch, i_yaw = airframe.inertia_kg_m2
    inputs = [
        w.acceleration_vertical_m_s2 * airframe.mass_kg,
        w.acceleration_roll_pitch_rad_s2 * i_roll,
        w.acceleration_roll_pitch_rad_s2 * i_pitch,
        w.acceleration_yaw_rad_s2 * i_yaw,
    ]
    return np.diag([1 / value**2 for value in states]), np.diag([1 / value**2 for value in inputs])


@dataclass(frozen=True, slots=True)
class Gains:
    """u = -Kx x - Ki sum((y - r) dt), with the shapes of the linear model.

    Attributes:
        kx: shape (4, 8).
        ki: shape (4, 4).
        poles: eigenvalues of the closed loop per sample, shape (12,), all inside the unit circle.
    """

    kx: Array
    ki: Array
    poles: npt.NDArray[np.complex128]


@lru_cache(_DESIGNS_KEPT)
def design(airframe: Airframe, period_s: float) -> Gains:
    """Design the regulator with integrals of all outputs for an airframe and a control period.

    All callers share the arrays, so they must not be changed.
    """
    a, b = with_integrals(discretise(hover_model(airframe), period_s), period_s)
    q, r = cost_matrices(airframe)
    k = _regulator(a, b, q, r)
    return Gains(k[:, :8], k[:, 8:], np.linalg.eigvals(a - b @ k).astype(np.complex128))


@dataclass(frozen=True, slots=True)
class Bandwidths:
    """A regulator without integrals, u = -K x, as nested loops, each with its bandwidth in 1/s.

    The velocity error times its bandwidth is the desired acceleration, which gives a desired angle; the
    angle's error times its bandwidth is the desired body rate; its error times its bandwidth is the desired
    angular acceleration.

    Attributes:
        velocity_level: forward, right, down; shape (3,).
        attitude: roll, pitch; shape (2,).
        rate: roll, pitch, yaw; shape (3,).
        poles: eigenvalues of the closed loop per sample, shape (8,).
    """

    velocity_level: tuple[float, float, float]
    attitude: tuple[float, float]
    rate: tuple[float, float, float]
    poles: npt.NDArray[np.complex128]


@lru_cache(_DESIGNS_KEPT)
def design_bandwidths(airframe: Airframe, period_s: float) -> Bandwidths:
    """Design the nested loops of an airframe, as `design` does but without integrals.

    Unknown forces and moments are left to an observer, which by the separation principle moves no pole of
    this design.
    """
    model = discretise(hover_model(airframe), period_s)
    q, r = cost_matrices(airframe)
    k = _regulator(model.a, model.b, q[:8, :8], r)
    i_roll, i_pitch, i_yaw = airframe.inertia_kg_m2
    return Bandwidths(
        (
            float(-GRAVITY_M_S2 * k[2, 5] / k[2, 1]),
            float(GRAVITY_M_S2 * k[1, 6] / k[1, 0]),
            float(-k[0, 7] / airframe.mass_kg),
        ),
        (float(k[1, 0] / k[1, 2]), float(k[2, 1] / k[2, 3])),
        (float(k[1, 2] / i_roll), float(k[2, 3] / i_pitch), float(k[3, 4] / i_yaw)),
        np.linalg.eigvals(model.a - model.b @ k).astype(np.complex128),
    )


def _regulator(a: Array, b: Array, q: Array, r: Array) -> Array:
    """K = (R + B'PB)^-1 B'PA, with P of the discrete algebraic Riccati equation.

    Source: Anderson & Moore, "Optimal Control", 1990, section 3.3.
    """
    p = solve_discrete_are(a, b, q, r)
    gains: Array = np.linalg.solve(r + b.T @ p @ b, b.T @ p @ a).astype(np.float64)
    return gains
