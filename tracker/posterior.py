"""The covariance after an update: one linear step from the prior with the converged slope, compiled."""

from __future__ import annotations

import numpy as np

from tracker.compiled import compiled
from tracker.correction import factor, forward, innovation_covariance, moved
from tracker.measure import Indices
from tracker.noise import learned
from tracker.types import Array


@compiled("f8[:, ::1](f8[:, ::1], f8[:, ::1], f8[:, ::1])")
def joseph(P: Array, H: Array, R: Array) -> Array:
    """Return the covariance (n, n) after a linear update of slope H (m, n) and noise R (m, m).

    Source: P+ = (I - K H) P (I - K H)' + K R K' with K = P H' S^-1, the form of Bucy and Joseph.
    """
    m, n = H.shape
    L = factor(innovation_covariance(H, P, R))
    whitened = forward(L, np.eye(m))  # L^-1, so K = P H' L^-T L^-1
    HP, K, rest = np.zeros((m, n)), np.zeros((n, m)), np.eye(n)
    for i in range(m):
        for k in range(n):
            for j in range(n):
                HP[i, j] += H[i, k] * P[k, j]
    white = forward(L, HP)
    for j in range(n):
        for i in range(m):
            for k in range(i + 1):
                K[j, k] += white[i, j] * whitened[i, k]
        for i in range(m):
            for k in range(n):
                rest[j, k] -= K[j, i] * H[i, k]
    return innovation_covariance(rest, P, innovation_covariance(K, R, np.zeros((n, n))))


@compiled("Tuple((f8[::1], f8[:, ::1], f8[:, ::1]))(f8[::1], f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1],"
          " f8[:, ::1], i8[::1], f8[::1], f8[:, ::1])")  # fmt: skip
def settled(
    mean: Array, dx: Array, P: Array, H: Array, R: Array, noise: Array, cameras: Indices, u: Array, inverse: Array
) -> tuple[Array, Array, Array]:
    """Return mean, covariance and the cameras' noise after an update; arguments as in `Fit` and `learned`.

    Source: exp(theta + d) = exp(theta) exp(J_r(theta) d), so the error about the new attitude is J_r d.
    """
    E, J_r, turn = np.empty((3, 3)), np.empty((3, 3)), np.eye(len(P))
    now = moved(mean, dx, E, J_r)
    turn[3:6, 3:6] = J_r
    after = innovation_covariance(turn, joseph(P, H, R), np.zeros(P.shape))
    return now, after, learned(noise, cameras, u, inverse)
