"""Designs the stabiliser: a discrete linear-quadratic regulator with integral action."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field
from scipy.linalg import solve_discrete_are

from firmware_py.airframe import Airframe
from firmware_py.control.linear_model import Array, discretise, hover_model, with_integrals


class Weights(BaseModel):
    """What the regulator counts as equally bad (Bryson's rule: each weight is 1 / value^2).

    Torque and thrust weights are in units of angular and linear acceleration, so the same numbers suit
    airframes of any size.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    tilt_rad: float = Field(0.6, gt=0)
    roll_pitch_rate_rad_s: float = Field(4.0, gt=0)
    yaw_rate_rad_s: float = Field(0.5, gt=0)
    velocity_horizontal_m_s: float = Field(0.6, gt=0)
    velocity_vertical_m_s: float = Field(0.3, gt=0)
    integral_horizontal_m: float = Field(0.3, gt=0)
    integral_vertical_m: float = Field(0.1, gt=0)
    integral_yaw_rad: float = Field(0.1, gt=0)
    acceleration_vertical_m_s2: float = Field(3.0, gt=0)
    acceleration_roll_pitch_rad_s2: float = Field(60.0, gt=0)
    acceleration_yaw_rad_s2: float = Field(6.0, gt=0)


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
        weights: what to weigh how much.
    """
    a, b = with_integrals(discretise(hover_model(airframe), period_s), period_s)
    q, r = cost_matrices(airframe, weights or Weights())
    p = solve_discrete_are(a, b, q, r)
    k: Array = np.linalg.solve(r + b.T @ p @ b, b.T @ p @ a).astype(np.float64)
    return Gains(k[:, :8], k[:, 8:], np.linalg.eigvals(a - b @ k).astype(np.complex128))
