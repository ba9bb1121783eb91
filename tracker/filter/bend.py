"""What pixels do beyond first order while the pose is open, as noise.

One camera that sees two balls leaves two movements open: the turn about their line, and nearer together with tilted,
which look the same. Linearised, both are straight; truly they bend, and a filter that takes its tangent for the path
takes every step of its own estimate along it for knowledge of where on it the vehicle is. What bends is noise, until it
is small against the pixels' own.
"""

from __future__ import annotations

import math

import numpy as np

from tracker.filter.correction import moved
from tracker.filter.measure import Indices, pixels
from tracker.maths.compiled import compiled
from tracker.types import Array

OPEN = 3  # directions of the pose that are known least; the others are straight within their sigma
POSE = 6  # components of the error


@compiled("f8[:, ::1](f8[:, ::1], f8)")
def _open_directions(P: Array, arm_m: float) -> Array:
    """Return the pose's OPEN widest principal sigmas as errors (OPEN, 6), turns weighed by how far they move an arm."""
    scale = np.array([1.0, 1.0, 1.0, arm_m, arm_m, arm_m])
    variances, axes = np.linalg.eigh(np.ascontiguousarray(P[:POSE, :POSE]) * np.outer(scale, scale))
    found = np.empty((OPEN, POSE))
    for k in range(OPEN):
        widest = POSE - 1 - k
        found[k] = math.sqrt(max(variances[widest], 0.0)) * axes[:, widest] / scale
    return found


@compiled("f8[::1](f8[::1], f8[::1], f8[::1], i8, f8, i8[::1], i8[::1], f8[::1], f8[:, ::1], f8[:, ::1])")
def _curve(
    mean: Array, uv: Array, way: Array, size: int, T: float, cameras: Indices, balls: Indices, lags_s: Array,
    table: Array, points_inB: Array,
) -> Array:  # fmt: skip
    """Return the second derivative (2n,) of the pixels uv (2n,) along an error of the pose (6,), by differences."""
    E, J_r, step = np.empty((3, 3)), np.empty((3, 3)), np.zeros(size)
    found = -2.0 * uv
    for sign in (-1.0, 1.0):
        step[:POSE] = sign * way
        found += pixels(moved(mean, step, E, J_r), T, cameras, balls, lags_s, table, points_inB)[0]
    return found


@compiled("f8[:, ::1](f8[::1], f8[::1], f8[:, ::1], f8, i8[::1], i8[::1], f8[::1], f8[:, ::1], f8[:, ::1])")
def bend_noise(
    mean: Array, dx: Array, P: Array, T: float, cameras: Indices, balls: Indices, lags_s: Array, table: Array,
    points_inB: Array,
) -> Array:  # fmt: skip
    """Return the covariance (2n, 2n) [px^2] of what the pose's error does to pixels beyond first order.

    Args:
        mean, dx: the prior's, and the error found.  P: (size, size) after the update.
        T, cameras, balls, lags_s, table, points_inB: as `pixels` takes them.
    Returns:
        NaN when a ball comes to lie behind a camera.
    Source: second-order filter, Bar-Shalom, Li, Kirubarajan, 10.3.2: with D_ab the second derivatives by independent
        errors of variance 1, the covariance is sum_a D_aa D_aa' / 2 + sum_(a<b) D_ab D_ab'; the mean sum_a D_aa / 2
        is counted in. Along a + b the second derivative is D_aa + D_bb + 2 D_ab.
    """
    n, size = 2 * len(cameras), len(P)
    ways = _open_directions(P, math.sqrt((points_inB**2).sum() / len(points_inB)))
    E, J_r = np.empty((3, 3)), np.empty((3, 3))
    here = moved(mean, dx, E, J_r)
    uv = pixels(here, T, cameras, balls, lags_s, table, points_inB)[0]
    noise, middle, own = np.zeros((n, n)), np.zeros(n), np.empty((OPEN, n))
    for a in range(OPEN):
        own[a] = _curve(here, uv, ways[a], size, T, cameras, balls, lags_s, table, points_inB)
        noise += np.outer(own[a], own[a]) / 2.0
        middle += own[a] / 2.0
        for b in range(a):
            both = _curve(here, uv, ways[a] + ways[b], size, T, cameras, balls, lags_s, table, points_inB)
            D = (both - own[a] - own[b]) / 2.0
            noise += np.outer(D, D)
    return noise + np.outer(middle, middle)
