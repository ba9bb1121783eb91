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

from tracker.filter.correction import inverse_of
from tracker.maths.compiled import compiled
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


@compiled("Tuple((f8[::1], f8[:, ::1]))(f8[::1], f8[::1], i8)")
def moved_to(mean: Array, m: Array, size: int) -> tuple[Array, Array]:
    """Return the mean of the point that stands at m in the frame of `mean`, and d its error / d error (size, size).

    Source: that point has place p + R m, speed v + R (w x m), acceleration a + R (alpha x m + w x (w x m)).
    """
    after, J = mean.copy(), np.eye(size)
    R = mean[3:12].copy().reshape(3, 3)
    w, alpha = mean[15:18].copy(), mean[21:24].copy()
    speed = _cross(w, m)
    pull = _cross(alpha, m) + _cross(w, speed)
    by_arm, by_speed, by_pull = _turned_cross(R, m), _turned_cross(R, speed), _turned_cross(R, pull)
    for i in range(3):
        for j in range(3):
            after[i] += R[i, j] * m[j]
            after[12 + i] += R[i, j] * speed[j]
            after[18 + i] += R[i, j] * pull[j]
            J[i, 3 + j] = J[6 + i, 9 + j] = J[12 + i, 15 + j] = -by_arm[i, j]
            J[6 + i, 3 + j], J[12 + i, 3 + j] = -by_speed[i, j], -by_pull[i, j]
            J[12 + i, 9 + j] = -by_speed[i, j]
    for j in range(3):  # w x (dw x m) = -[w]x [m]x dw
        unit = np.zeros(3)
        unit[j] = 1.0
        column = _cross(w, _cross(unit, m))
        for i in range(3):
            J[12 + i, 9 + j] += R[i, 0] * column[0] + R[i, 1] * column[1] + R[i, 2] * column[2]
    return after, J
