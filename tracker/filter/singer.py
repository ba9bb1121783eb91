"""How state and error go on in time: accelerations that fade, as Singer has them.

Source: Singer, "Estimating optimal tracking filter performance for manned maneuvering targets", IEEE Trans. AES 6
    (1970); Bar-Shalom, Li, Kirubarajan, "Estimation with Applications to Tracking and Navigation", 8.2.3: an
    acceleration of zero mean, variance s and correlation exp(-|t| / T). White acceleration would forget within a
    frame what the last frames told, and free-running cameras have to bridge half a frame.
"""

from __future__ import annotations

import math

import numpy as np

from tracker.maths.compiled import compiled
from tracker.maths.so3_compiled import turn_into
from tracker.types import Array

SHORT = 0.02  # of T: below, the closed forms cancel and their first terms serve


@compiled("UniTuple(f8, 3)(f8, f8)")
def faded(dt: float, T: float) -> tuple[float, float, float]:
    """Return what an acceleration of 1 leaves after dt: of place, of speed, of itself; dt may be negative.

    The expected past mirrors the expected future: exp(-|dt| / T) either way.
    """
    x = abs(dt) / T
    rest = math.exp(-x)
    place = dt * dt * (0.5 - x / 6.0) if x < 1e-4 else T * T * (x - 1.0 + rest)
    speed = T * (1.0 - rest)
    return place, speed if dt >= 0.0 else -speed, rest


@compiled("UniTuple(f8, 6)(f8, f8)")
def unit_noise(dt: float, T: float) -> tuple[float, float, float, float, float, float]:
    """Return the noise gathered over dt >= 0 by an acceleration of variance 1, for one axis.

    Returns:
        place-place, place-speed, place-acceleration, speed-speed, speed-acceleration, acceleration-acceleration.
    Source: Bar-Shalom, Li, Kirubarajan, 8.2.3-10.
    """
    x = dt / T
    if x < SHORT:
        return (
            T**4 * x**5 / 10.0, T**3 * x**4 / 4.0, T * T * x**3 / 3.0,
            T * T * 2.0 * x**3 / 3.0, T * x * x, 2.0 * x,
        )  # fmt: skip
    once, twice = math.exp(-x), math.exp(-2.0 * x)
    return (
        T**4 * (1.0 - twice + 2.0 * x + 2.0 * x**3 / 3.0 - 2.0 * x * x - 4.0 * x * once),
        T**3 * (twice + 1.0 - 2.0 * once + 2.0 * x * once - 2.0 * x + x * x),
        T * T * (1.0 - twice - 2.0 * x * once),
        T * T * (4.0 * once - 3.0 - twice + 2.0 * x),
        T * (twice + 1.0 - 2.0 * once),
        1.0 - twice,
    )


@compiled("Tuple((f8[::1], f8[:, ::1]))(f8[::1], f8, f8, i8)")
def carried(mean: Array, dt: float, T: float, size: int) -> tuple[Array, Array]:
    """Carry a nominal state (`State.mean`) on by dt.

    Returns:
        The mean then, and F (size, size), d error(t + dt) / d error(t).
    Source: the body turns by phi = w dt + alpha place; with R exp(theta) exp(phi) = R exp(phi) exp(exp(-phi) theta) and
        exp(phi + d) = exp(phi) exp(J_r(phi) d) to first order.
    """
    place, speed, rest = faded(dt, T)
    after, F = mean.copy(), np.eye(size)
    E, J = np.empty((3, 3)), np.empty((3, 3))
    for i in range(3):
        after[i] += dt * mean[12 + i] + place * mean[18 + i]
        after[12 + i] += speed * mean[18 + i]
        after[15 + i] += speed * mean[21 + i]
        after[18 + i] *= rest
        after[21 + i] *= rest
    turn_into(
        dt * mean[15] + place * mean[21], dt * mean[16] + place * mean[22], dt * mean[17] + place * mean[23], E, J
    )
    for i in range(3):
        F[i, 6 + i], F[i, 12 + i], F[6 + i, 12 + i], F[12 + i, 12 + i] = dt, place, speed, rest
        F[9 + i, 15 + i], F[15 + i, 15 + i] = speed, rest
        for j in range(3):
            after[3 + 3 * i + j] = mean[3 + 3 * i] * E[0, j] + mean[4 + 3 * i] * E[1, j] + mean[5 + 3 * i] * E[2, j]
            F[3 + i, 3 + j] = E[j, i]
            F[3 + i, 9 + j] = J[i, j] * dt
            F[3 + i, 15 + j] = J[i, j] * place
    return after, F


@compiled("f8[:, ::1](i8, f8, f8, f8, f8)")
def process_noise(size: int, dt: float, T: float, translation: float, rotation: float) -> Array:
    """Return Q (size, size) gathered over dt by accelerations of these variances [m^2/s^4], [rad^2/s^4]."""
    Q = np.zeros((size, size))
    pp, pv, pa, vv, va, aa = unit_noise(dt, T)
    for first, variance in ((0, translation), (3, rotation)):
        for i in range(first, first + 3):
            Q[i, i], Q[6 + i, 6 + i], Q[12 + i, 12 + i] = variance * pp, variance * vv, variance * aa
            Q[i, 6 + i] = Q[6 + i, i] = variance * pv
            Q[i, 12 + i] = Q[12 + i, i] = variance * pa
            Q[6 + i, 12 + i] = Q[12 + i, 6 + i] = variance * va
    return Q
