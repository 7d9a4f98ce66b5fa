"""The multicopter's linear model at hover, from the airframe's numbers.

States x = [roll, pitch, p, q, r, v_forward, v_right, v_down] (level axes that turn with the yaw), inputs
u = [thrust beyond weight N, roll moment, pitch moment, yaw moment N m] in body FRD, outputs
y = [v_forward, v_right, v_down, r]. Quadratic drag vanishes at hover. Source of the equations: Newton-Euler
at small angles, as in Casado & Bermúdez, Electronics 2021, 10, 7, section 3, in FRD instead of FLU axes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.linalg import expm

from firmware_py.airframe import GRAVITY_M_S2, Airframe

Array = npt.NDArray[np.float64]

STATES = ("roll", "pitch", "p", "q", "r", "v_forward", "v_right", "v_down")
INPUTS = ("thrust", "roll_moment", "pitch_moment", "yaw_moment")
OUTPUTS = ("v_forward", "v_right", "v_down", "r")


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
    a[6, 0] = GRAVITY_M_S2  # right side down pulls right
    b = np.zeros((8, 4))
    b[2, 1], b[3, 2], b[4, 3] = 1 / i_roll, 1 / i_pitch, 1 / i_yaw
    b[7, 0] = -1 / airframe.mass_kg
    c = np.zeros((4, 8))
    c[0, 5] = c[1, 6] = c[2, 7] = c[3, 4] = 1.0
    return LinearModel(a, b, c)


def allocation(airframe: Airframe) -> Array:
    """Return the matrix from squared rotor speeds to [thrust, roll, pitch, yaw moment].

    Args:
        airframe: its rotors' true positions give the arms.

    Returns:
        Shape (4, rotors); thrust is positive upwards, moments are FRD. A thrust f at (x, y) gives the
        moment r x F = (-y f, x f, 0) with F = (0, 0, -f).
    """
    motor = airframe.motor
    columns = [
        (
            motor.thrust_n_s2,
            -rotor.position_frd_m[1] * motor.thrust_n_s2,
            rotor.position_frd_m[0] * motor.thrust_n_s2,
            rotor.yaw_sign * motor.torque_nm_s2,
        )
        for rotor in airframe.rotors
    ]
    return np.array(columns).T


def discretise(model: LinearModel, period_s: float) -> LinearModel:
    """Return the exact model at sampling instants for inputs held constant between them.

    The block exponential of Van Loan, "Computing integrals involving the matrix exponential", 1978.

    Args:
        model: continuous.
        period_s: sampling period.
    """
    states, inputs = model.b.shape
    block = np.zeros((states + inputs, states + inputs))
    block[:states, :states], block[:states, states:] = model.a, model.b
    power = expm(block * period_s)
    return LinearModel(power[:states, :states], power[:states, states:], model.c)


def with_integrals(model: LinearModel, period_s: float) -> tuple[Array, Array]:
    """Augment a discrete model with the integrals of its outputs.

    Args:
        model: discrete, with n states and m outputs.
        period_s: sampling period.

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
