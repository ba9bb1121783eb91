"""How state and error go on in time: accelerations that fade smoothly, and may change at once.

An acceleration of zero mean, variance s and correlation (1 + x) exp(-x), x = 2 |t| / T: Matern's of 3/2. It has a jerk,
which two frames tell and free-running cameras need to bridge half a frame; where nothing is seen it fades, as Singer's
exp(-|t| / T) does, and T is the integral of either. A manoeuvre may begin between two frames: white noise that drives
the acceleration itself comes on top.

Source: Singer, "Estimating optimal tracking filter performance for manned maneuvering targets", IEEE Trans. AES 6
    (1970), for accelerations that fade; Hartikainen, Sarkka, "Kalman filtering and smoothing solutions to temporal
    Gaussian process regression models", IEEE MLSP (2010), 4.1: with r = 2 / T, acceleration a and jerk j go by

        da = j dt + sudden,  dj = -(r^2 a + 2 r j) dt + smooth,  smooth being white of density 4 r^3 s.     (1)
"""

from __future__ import annotations

import math

import numpy as np

from tracker.maths.compiled import compiled
from tracker.maths.so3_compiled import turn_into
from tracker.types import Array

MOTIONS = 2  # translation (W), rotation (B): each as brisk on its three axes
KINDS = 2  # of noise that drives a motion: smooth, sudden
SHORT = 1e-3  # of x: below, the closed forms cancel and their first terms serve
NODES, WEIGHTS = (tuple(column.tolist()) for column in np.polynomial.legendre.leggauss(10))


@compiled("UniTuple(f8, 8)(f8, f8)")
def faded(dt: float, T: float) -> tuple[float, float, float, float, float, float, float, float]:
    """Return what is left after dt of an acceleration of 1, then of a jerk of 1; dt may be negative.

    Returns:
        Of each: place, speed, acceleration, jerk.
    Source: (1) without noise, a jerk of 1 leaves the acceleration t exp(-r t), an acceleration of 1 leaves
        (1 + r t) exp(-r t); integrated twice. The expected past mirrors the expected future.
    """
    rate, sign = 2.0 / T, 1.0 if dt >= 0.0 else -1.0
    x = rate * abs(dt)
    rest = math.exp(-x)
    gone = 1.0 - rest
    if x < SHORT:
        by_acceleration, by_jerk = x * x * (0.5 - x * x / 24.0), x**3 * (1.0 / 6.0 - x / 12.0)
    else:
        by_acceleration, by_jerk = 2.0 * x - 3.0 * gone + x * rest, x - 2.0 * gone + x * rest
    return (
        by_acceleration / rate**2, sign * (2.0 * gone - x * rest) / rate, (1.0 + x) * rest, -sign * rate * x * rest,
        sign * by_jerk / rate**3, (gone - x * rest) / rate**2, sign * x * rest / rate, (1.0 - x) * rest,
    )  # fmt: skip


@compiled("f8[:, :, ::1](f8, f8)")
def unit_noise(dt: float, T: float) -> Array:
    """Return the noise (KINDS, 4, 4) of place, speed, acceleration and jerk gathered over dt >= 0 on one axis.

    Smooth: by an acceleration of variance 1; sudden: by white noise of density 1 that drives the acceleration.
    Source: the integral of g g' times (1)'s density, g being what `faded` leaves of a jerk or of an acceleration, by
        Gauss's quadrature: exact to rounding up to T, to 1e-5 up to 5 T.
    """
    Q = np.zeros((KINDS, 4, 4))
    for k in range(len(NODES)):
        left = faded(dt * (1.0 + NODES[k]) / 2.0, T)
        sudden = WEIGHTS[k] * dt / 2.0
        smooth = sudden * 4.0 * (2.0 / T) ** 3
        for i in range(4):
            for j in range(4):
                Q[0, i, j] += smooth * left[4 + i] * left[4 + j]
                Q[1, i, j] += sudden * left[i] * left[j]
    return Q


@compiled("Tuple((f8[::1], f8[:, ::1]))(f8[::1], f8, f8, i8)")
def carried(mean: Array, dt: float, T: float, size: int) -> tuple[Array, Array]:
    """Carry a nominal state (`State.mean`) on by dt.

    Returns:
        The mean then, and F (size, size), d error(t + dt) / d error(t).
    Source: the body turns by phi = w dt + alpha place + beta place, `faded` giving either place; with R exp(theta)
        exp(phi) = R exp(phi) exp(exp(-phi) theta) and exp(phi + d) = exp(phi) exp(J_r(phi) d) to first order.
    """
    p_a, v_a, a_a, j_a, p_j, v_j, a_j, j_j = faded(dt, T)
    after, F = mean.copy(), np.eye(size)
    E, J, phi = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    for i in range(3):
        after[i] += dt * mean[12 + i] + p_a * mean[18 + i] + p_j * mean[24 + i]
        phi[i] = dt * mean[15 + i] + p_a * mean[21 + i] + p_j * mean[27 + i]
        F[i, 6 + i], F[i, 12 + i], F[i, 18 + i] = dt, p_a, p_j
    for k in range(6):  # the place's derivatives, then the turn's
        a, j = mean[18 + k], mean[24 + k]
        after[12 + k] += v_a * a + v_j * j
        after[18 + k], after[24 + k] = a_a * a + a_j * j, j_a * a + j_j * j
        F[6 + k, 12 + k], F[6 + k, 18 + k] = v_a, v_j
        F[12 + k, 12 + k], F[12 + k, 18 + k] = a_a, a_j
        F[18 + k, 12 + k], F[18 + k, 18 + k] = j_a, j_j
    turn_into(phi[0], phi[1], phi[2], E, J)
    for i in range(3):
        for j in range(3):
            after[3 + 3 * i + j] = mean[3 + 3 * i] * E[0, j] + mean[4 + 3 * i] * E[1, j] + mean[5 + 3 * i] * E[2, j]
            F[3 + i, 3 + j] = E[j, i]
            F[3 + i, 9 + j], F[3 + i, 15 + j], F[3 + i, 21 + j] = J[i, j] * dt, J[i, j] * p_a, J[i, j] * p_j
    return after, F


@compiled("f8[:, ::1](i8, f8, f8, f8[::1])")
def process_noise(size: int, dt: float, T: float, strengths: Array) -> Array:
    """Return Q (size, size) gathered over dt.

    strengths: (KINDS * MOTIONS,) of smooth translation and rotation, variances of the acceleration [m^2/s^4],
    [rad^2/s^4]; then of sudden, densities of what drives it [m^2/s^5], [rad^2/s^5].
    """
    Q, unit = np.zeros((size, size)), unit_noise(dt, T)
    for axis in range(6):
        motion = axis // 3
        for i in range(4):
            for j in range(4):
                smooth, sudden = strengths[motion] * unit[0, i, j], strengths[MOTIONS + motion] * unit[1, i, j]
                Q[axis + 6 * i, axis + 6 * j] = smooth + sudden
    return Q
