"""How far an open turn carries the body's points off the tangent that a linear covariance takes for their path.

Turned by phi about the unit axis e, an arm a comes to a + sin(phi) e x a - (1 - cos(phi)) (a - e (e.a)); the tangent is
a + phi e x a. With one ball hidden phi may be wrong by tens of degrees, and what lies between path and tangent is then
many times what the pixels leave open.
"""

from __future__ import annotations

import math

import numpy as np

from tracker.filter.measure import Indices
from tracker.filter.pivot import LEAST_OPEN_TURN_RAD
from tracker.maths.compiled import compiled
from tracker.state import State
from tracker.types import Array

REACH = 4.0  # sigmas of a turn up to which the sag below stands within as many of its own sigmas
ACROSS = REACH / 2.0
ALONG = REACH**2 / 6.0


@compiled("Tuple((f8, f8[::1]))(f8[:, ::1])")
def widest_turn(P: Array) -> tuple[float, Array]:
    """Return one sigma [rad] and the axis (3,) in B of the turn that is known least."""
    variances, axes = np.linalg.eigh(np.ascontiguousarray(P[3:6, 3:6]))
    return math.sqrt(max(variances[2], 0.0)), np.ascontiguousarray(axes[:, 2])


def sag_covariance(state: State) -> Array:
    """Return the covariance (3, 3) of the position's second and third order error by the turn known least [m^2].

    Source: the origin goes along the tangent g = d p / d phi, by regression on phi, and the circle about the axis e
        takes it off by phi^2 / 2 e x g - phi^3 / 6 g. At REACH sigmas of phi each is REACH of its sigmas: the factors
        are REACH / 2 s^2 and REACH^2 / 6 s^3.
    """
    return sag(state.R_BtoW, state.P)


@compiled("f8[:, ::1](f8[:, :], f8[:, ::1])")
def sag(R: Array, P: Array) -> Array:
    """Return what `sag_covariance` does; zeros where no turn is open."""
    found = np.zeros((3, 3))
    if P[3, 3] + P[4, 4] + P[5, 5] < LEAST_OPEN_TURN_RAD**2:
        return found
    sigma, axis_inB = widest_turn(P)
    e, g = np.zeros(3), np.zeros(3)
    for i in range(3):
        for j in range(3):
            e[i] += R[i, j] * axis_inB[j]
            g[i] += P[i, 3 + j] * axis_inB[j] / sigma**2
    across = (e[1] * g[2] - e[2] * g[1], e[2] * g[0] - e[0] * g[2], e[0] * g[1] - e[1] * g[0])
    for i in range(3):
        for j in range(3):
            found[i, j] = across[i] * across[j] * (ACROSS * sigma**2) ** 2 + g[i] * g[j] * (ALONG * sigma**3) ** 2
    return found


@compiled("f8[:, ::1](f8[:, ::1], i8[::1], f8[:, ::1], f8[::1], f8[:, ::1])")
def sag_noise(H: Array, balls: Indices, points_inB: Array, mean: Array, P: Array) -> Array:
    """Return the covariance (2n, 2n) [px^2] of what that turn does to sightings beyond first order.

    H: (2n, size) slope of the sightings.  balls: (n,).  points_inB: (balls, 3) from the point that `mean` is told of.
    """
    sigma, e = widest_turn(P)
    across, along = np.zeros(len(H)), np.zeros(len(H))
    for i in range(len(H)):
        a = points_inB[balls[i // 2]]
        ea = e[0] * a[0] + e[1] * a[1] + e[2] * a[2]
        t = (e[1] * a[2] - e[2] * a[1], e[2] * a[0] - e[0] * a[2], e[0] * a[1] - e[1] * a[0])
        for k in range(3):
            for j in range(3):
                by_arm = H[i, k] * mean[3 + 3 * k + j]
                across[i] += by_arm * (e[j] * ea - a[j]) * ACROSS * sigma**2
                along[i] -= by_arm * t[j] * ALONG * sigma**3
    return np.outer(across, across) + np.outer(along, along)
