"""The point of the body that is known best, about which an open turn turns it.

While one ball is hidden, two show everything but the turn about their line. Told of the body's origin, which lies off
that line, an open turn is a movement on a circle: its tangent changes with every step of the estimate, and a filter
that compares the tangent of one step with that of the next takes the difference for knowledge of the turn. Told of a
point on the line, the turn moves nothing, however far it goes: what pixels cannot see stays unseen. So the filter
predicts and updates the state of that point, and gives back the origin's.

Source: the same false information is known from SLAM, where the remedy is to keep what cannot be observed in one
    direction: Huang, Mourikis, Roumeliotis, "Observability-based rules for designing consistent EKF SLAM estimators",
    Int. J. Robotics Research 29 (2010); Barrau and Bonnabel, "The invariant extended Kalman filter as a stable
    observer", IEEE Trans. Automatic Control 62 (2017).
"""

from __future__ import annotations

import numpy as np

from tracker.maths.compiled import compiled
from tracker.maths.covariance import inverse_of
from tracker.types import Array

LEAST_OPEN_TURN_RAD = 0.01  # one sigma: below it, circle and tangent are the same to the pixels


@compiled("f8[::1](f8[::1], f8[:, ::1])")
def best_known(mean: Array, P: Array) -> Array:
    """Return the point (3,) in B whose place is known best [m], the origin where no turn is open.

    Source: with q the origin's error in B, the point m errs by q - m x theta; setting the derivative of its expected
        square to zero gives (tr(S) I - S) m = E[theta x q], S = E[theta theta'].
    """
    trace = P[3, 3] + P[4, 4] + P[5, 5]
    if trace < LEAST_OPEN_TURN_RAD**2:
        return np.zeros(3)
    left, both = np.empty((3, 3)), np.zeros((3, 3))
    for i in range(3):
        for j in range(3):
            left[i, j] = (trace if i == j else 0.0) - P[3 + i, 3 + j]
            for k in range(3):
                both[i, j] += P[3 + i, k] * mean[3 + 3 * k + j]  # E[theta q'], q = R' dp
    inverse = inverse_of(left)
    right = (both[1, 2] - both[2, 1], both[2, 0] - both[0, 2], both[0, 1] - both[1, 0])
    m = np.zeros(3)
    for i in range(3):
        for j in range(3):
            m[i] += inverse[i, j] * right[j]
    return m


@compiled("f8[::1](f8[::1], f8[::1])")
def _cross(a: Array, b: Array) -> Array:
    found = np.empty(3)
    found[0], found[1], found[2] = a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    return found


@compiled("f8[:, ::1](f8[:, ::1], f8[::1])")
def _turned_cross(R: Array, a: Array) -> Array:
    """Return R [a]x (3, 3)."""
    found = np.empty((3, 3))
    for i in range(3):
        found[i, 0] = R[i, 1] * a[2] - R[i, 2] * a[1]
        found[i, 1] = R[i, 2] * a[0] - R[i, 0] * a[2]
        found[i, 2] = R[i, 0] * a[1] - R[i, 1] * a[0]
    return found


@compiled("void(f8[:, ::1], f8[:, ::1], f8[::1], f8[::1], f8[::1])")
def _turn_slopes(J: Array, R: Array, w: Array, alpha: Array, m: Array) -> None:
    """Write how acceleration and jerk of the point m go with rate and angular acceleration, see `moved_to`."""
    speed, swing, e = _cross(w, m), _cross(alpha, m), np.zeros(3)
    pull = swing + _cross(w, speed)
    for j in range(3):
        e[:] = 0.0
        e[j] = 1.0
        arm = _cross(e, m)
        pull_by_w = _cross(e, speed) + _cross(w, arm)
        jolt_by_w = _cross(alpha, arm) + _cross(e, swing + pull) + _cross(w, pull_by_w)
        jolt_by_alpha = _cross(e, speed) + 2.0 * _cross(w, arm)
        for i in range(3):
            J[12 + i, 9 + j] = R[i, 0] * pull_by_w[0] + R[i, 1] * pull_by_w[1] + R[i, 2] * pull_by_w[2]
            J[18 + i, 9 + j] = R[i, 0] * jolt_by_w[0] + R[i, 1] * jolt_by_w[1] + R[i, 2] * jolt_by_w[2]
            J[18 + i, 15 + j] = R[i, 0] * jolt_by_alpha[0] + R[i, 1] * jolt_by_alpha[1] + R[i, 2] * jolt_by_alpha[2]


@compiled("Tuple((f8[::1], f8[:, ::1]))(f8[::1], f8[::1], i8)")
def moved_to(mean: Array, m: Array, size: int) -> tuple[Array, Array]:
    """Return the mean of the point that stands at m in the frame of `mean`, and d its error / d error (size, size).

    Source: that point has place p + R m and, since R x goes by R (dx / dt + w x x), speed v + R (w x m), acceleration
        a + R (alpha x m + w x (w x m)) and jerk
        j + R (beta x m + alpha x (w x m) + 2 w x (alpha x m) + w x (w x (w x m))).
    """
    after, J = mean.copy(), np.eye(size)
    R = mean[3:12].copy().reshape(3, 3)
    w, alpha, beta = mean[15:18].copy(), mean[21:24].copy(), mean[27:30].copy()
    speed, swing = _cross(w, m), _cross(alpha, m)
    pull = swing + _cross(w, speed)
    jolt = _cross(beta, m) + _cross(alpha, speed) + _cross(w, swing + pull)
    by_m = _turned_cross(R, m)
    arms = (m, speed, pull, jolt)
    for k in range(4):
        first = 6 + 6 * k if k > 0 else 0  # in `mean`; in the error it is 6 k
        by_arm = _turned_cross(R, arms[k])
        for i in range(3):
            after[first + i] += R[i, 0] * arms[k][0] + R[i, 1] * arms[k][1] + R[i, 2] * arms[k][2]
            for j in range(3):
                J[6 * k + i, 3 + j] = -by_arm[i, j]
                J[6 * k + i, 3 + 6 * k + j] = -by_m[i, j]
    _turn_slopes(J, R, w, alpha, m)
    return after, J
