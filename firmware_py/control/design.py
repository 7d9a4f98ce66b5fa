"""Designs the stabiliser: discrete linear-quadratic regulators, with integral action or as nested loops."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import solve_discrete_are

from firmware_py.airframe import GRAVITY_M_S2, Airframe
from firmware_py.control.linear_model import Array, discretise, hover_model, with_integrals
from firmware_py.control.weights import Weights


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


def cost_matrices(airframe: Airframe, weights: Weights) -> tuple[Array, Array]:
    """Return Q of shape (12, 12) and R of shape (4, 4) of the quadratic cost."""
    w = weights
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


def design(airframe: Airframe, period_s: float, weights: Weights | None = None) -> Gains:
    """Solve the discrete algebraic Riccati equation for an airframe.

    K = (R + B'PB)^-1 B'PA (e.g. Anderson & Moore, "Optimal Control", 1990, section 3.3).

    Args:
        airframe: its mass and inertia make the model.
        period_s: control period.
        weights: what to weigh how much; by default what the airframe declares.
    """
    a, b = with_integrals(discretise(hover_model(airframe), period_s), period_s)
    q, r = cost_matrices(airframe, weights or airframe.stabiliser)
    k = _regulator(a, b, q, r)
    return Gains(k[:, :8], k[:, 8:], np.linalg.eigvals(a - b @ k).astype(np.complex128))


@dataclass(frozen=True, slots=True)
class Bandwidths:
    """A regulator without integrals, u = -K x, read as loops within loops, each with its bandwidth in 1/s.

    The velocity error times its bandwidth is the acceleration wanted; that makes an angle; the angle's error
    times its bandwidth is the body rate wanted; its error times its bandwidth is the angular acceleration.

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


def design_bandwidths(airframe: Airframe, period_s: float, weights: Weights | None = None) -> Bandwidths:
    """Design the nested loops of an airframe, as `design` does but with no integrals.

    Unknown forces and moments are then an observer's task, which by the separation principle moves no pole
    of this design.

    Args:
        airframe: its mass and inertia make the model.
        period_s: control period.
        weights: what to weigh how much; by default what the airframe declares.
    """
    model = discretise(hover_model(airframe), period_s)
    q, r = cost_matrices(airframe, weights or airframe.stabiliser)
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
    p = solve_discrete_are(a, b, q, r)
    gains: Array = np.linalg.solve(r + b.T @ p @ b, b.T @ p @ a).astype(np.float64)
    return gains
