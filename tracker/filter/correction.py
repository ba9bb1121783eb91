"""The inner loops of the filter's update, compiled: iterate to the likeliest state, weigh innovations."""

from __future__ import annotations

import math

import numpy as np

from tracker.filter.matern import KINDS, MOTIONS, unit_noise
from tracker.filter.measure import Indices, pixels
from tracker.maths.compiled import compiled
from tracker.maths.covariance import factor, forward, inverse_of, propagated
from tracker.maths.so3_compiled import turn_into
from tracker.maths.solve import dot
from tracker.types import Array

MAX_ITERATIONS = 8
CONVERGED_SIGMA = 0.01  # stop when the last step is this small against the posterior's own sigma
TILT_ROWS = 2


@compiled("Tuple((f8[::1], f8[:, ::1], f8))(f8[::1], f8[:, ::1], f8[:, ::1], f8[:, ::1])")
def weighed(y: Array, H: Array, P: Array, R: Array) -> tuple[Array, Array, float]:
    """Return S^-1 y, S^-1 and y' S^-1 y of the sightings, the two last rows (the tilt) left out."""
    n = len(y) - TILT_ROWS
    inverse = inverse_of(propagated(H[:n], P, R[:n, :n].copy()))
    u, nis = np.zeros(n), 0.0
    for i in range(n):
        for j in range(n):
            u[i] += inverse[i, j] * y[j]
        nis += u[i] * y[i]
    return u, inverse, nis


@compiled("f8[:, ::1](f8[:, ::1], f8[:, ::1], i8)")
def gathered_noise(H: Array, unit: Array, motion: int) -> Array:
    """Return H Q H' (2n, 2n) [px^2] for the process noise of one motion, unit (4, 4) on each axis, see `unit_noise`."""
    rows = len(H)
    slope, HQ, noise = np.empty((rows, 12)), np.zeros((rows, 12)), np.empty((rows, rows))
    for i in range(rows):
        for a in range(4):
            slope[i, 3 * a : 3 * a + 3] = H[i, 6 * a + 3 * motion : 6 * a + 3 * motion + 3]
        for a in range(4):
            for b in range(4):
                for axis in range(3):
                    HQ[i, 3 * b + axis] += slope[i, 3 * a + axis] * unit[a, b]
        for j in range(i + 1):
            noise[i, j] = noise[j, i] = dot(HQ[i], slope[j])
    return noise


@compiled("f8[:, :, ::1](f8[:, ::1], i8[::1], f8[::1], f8)")
def path_noise(H: Array, cameras: Indices, lags_s: Array, T: float) -> Array:
    """Return the covariances (KINDS * MOTIONS, 2n, 2n) [px^2] of an unknown path from the state's time to the cameras'.

    Each is by one strength of 1, in the order of `process_noise`.  lags_s: (n,) of each sighting's true time.
    """
    n = len(cameras)
    path = np.zeros((KINDS * MOTIONS, 2 * n, 2 * n))
    lag_s, unit = 0.0, np.empty((KINDS, 4, 4))
    for s in range(n):
        if lags_s[s] == 0.0:
            continue
        if lags_s[s] != lag_s:  # a camera's sightings mostly share theirs
            lag_s, unit = lags_s[s], unit_noise(abs(lags_s[s]), T)
        for i in range(2 * s, 2 * s + 2):
            for j in range(2 * n):
                if cameras[j // 2] == cameras[s]:
                    for axis in range(6):
                        by_axis = H[i, axis] * H[j, axis]
                        for kind in range(KINDS):
                            path[kind * MOTIONS + axis // 3, i, j] += unit[kind, 0, 0] * by_axis
    return path


@compiled("f8[::1](f8[::1], f8[::1], f8[:, ::1], f8[:, ::1])")
def moved(mean: Array, dx: Array, E: Array, J_r: Array) -> Array:
    """Return the mean with the error dx put in, and write exp and right Jacobian of its turn into E and J_r.

    The body's rate, angular acceleration and jerk stay what they were as seen from the room, to all orders of the
    turn: they become E' (w + dw + theta x w). A turn that no pixel sees must not alter how the seen balls go on.
    """
    now = mean.copy()
    turn_into(dx[3], dx[4], dx[5], E, J_r)
    for i in range(3):
        now[i] += dx[i]
        for j in range(3):
            now[3 + 3 * i + j] = mean[3 + 3 * i] * E[0, j] + mean[4 + 3 * i] * E[1, j] + mean[5 + 3 * i] * E[2, j]
    now[12:30] += dx[6:24]
    now[31:] += dx[24:]
    for first in (15, 21, 27):
        a, b, c = mean[first], mean[first + 1], mean[first + 2]
        x = now[first] + dx[4] * c - dx[5] * b
        y = now[first + 1] + dx[5] * a - dx[3] * c
        z = now[first + 2] + dx[3] * b - dx[4] * a
        for i in range(3):
            now[first + i] = E[0, i] * x + E[1, i] * y + E[2, i] * z
    return now


@compiled("f8[:, ::1](f8[::1], f8[::1], f8[:, ::1], f8[:, ::1], i8)")
def moved_slope(mean: Array, now: Array, E: Array, J_r: Array, size: int) -> Array:
    """Return d (error about `now`) / d dx (size, size), for the mean, E and J_r that `moved` began with and wrote.

    Source: exp(theta + d) = E exp(J_r d), and w' = E' (w + dw + theta x w) goes by
        E' d(dw) + ([w']x J_r - E' [w]x) d(theta).
    """
    G = np.eye(size)
    G[3:6, 3:6] = J_r
    for rows, first in ((9, 15), (15, 21), (21, 27)):
        w, then = mean[first : first + 3], now[first : first + 3]
        for i in range(3):
            p, q = (i + 1) % 3, (i + 2) % 3
            for j in range(3):
                G[rows + i, rows + j] = E[j, i]
                G[rows + i, 3 + j] = then[p] * J_r[q, j] - then[q] * J_r[p, j]
                u, v = (j + 1) % 3, (j + 2) % 3
                G[rows + i, 3 + j] -= E[u, i] * w[v] - E[v, i] * w[u]
    return G


@compiled("void(f8[::1], f8[:, ::1], f8[::1])")
def _tilt(mean: Array, H: Array, y: Array) -> None:
    """Write the two last rows: the room's vertical, seen in B, has no part along x and y when level.

    Source: R' z has the components of R's last row r; turned by theta it goes by [r]x theta.
    """
    rows = len(H)
    r = mean[9:12]
    y[rows - 2], y[rows - 1] = -r[0], -r[1]
    H[rows - 2, 3], H[rows - 2, 4], H[rows - 2, 5] = 0.0, -r[2], r[1]
    H[rows - 1, 3], H[rows - 1, 4], H[rows - 1, 5] = r[2], 0.0, -r[0]


@compiled("void(f8[:, ::1], f8[:, ::1])")
def _told_from_prior(H: Array, G: Array) -> None:
    """Write H G into H, for G from `moved_slope`, which mixes nothing but the turn and its derivatives."""
    through = np.empty(3)
    for i in range(len(H)):
        for j in range(3):
            through[j] = 0.0
            for first in (3, 9, 15, 21):
                for k in range(first, first + 3):
                    through[j] += H[i, k] * G[k, 3 + j]
        H[i, 3:6] = through
        for first in (9, 15, 21):
            for j in range(3):
                through[j] = 0.0
                for k in range(first, first + 3):
                    through[j] += H[i, k] * G[k, first + j]
            H[i, first : first + 3] = through


@compiled("Tuple((f8[::1], f8))(f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[::1], f8[::1], f8[::1])")
def _linear(P: Array, H: Array, R: Array, y: Array, dx: Array, variances: Array) -> tuple[Array, float]:
    """Return P H' S^-1 y (size,) and its largest step from dx in posterior sigmas; write the posterior variances."""
    m, n = H.shape
    HP, S = np.zeros((m, n + 1)), R.copy()
    for i in range(m):
        for k in range(n):
            if H[i, k] != 0.0:
                for j in range(n):
                    HP[i, j] += H[i, k] * P[k, j]
        for j in range(i + 1):  # of S no more than the lower half is asked for
            S[i, j] += dot(HP[i, :n], H[j])
        HP[i, n] = y[i]
    white = forward(factor(S), HP)
    new, biggest = np.zeros(n), 0.0
    for j in range(n):
        variances[j] = P[j, j]
        for i in range(m):
            new[j] += white[i, j] * white[i, n]
            variances[j] -= white[i, j] ** 2
        if variances[j] > 0.0:
            biggest = max(biggest, abs(new[j] - dx[j]) / math.sqrt(variances[j]))
    return new, biggest


@compiled("Tuple((f8[::1], f8[::1], f8[:, ::1], f8[::1]))(f8[::1], f8[:, ::1], f8, f8[::1], f8[:, ::1], i8[::1],"
          " i8[::1], f8[::1], f8[:, ::1], f8[:, ::1])")  # fmt: skip
def likeliest(
    mean: Array, P: Array, T: float, z: Array, R: Array, cameras: Indices, balls: Indices, lags_s: Array,
    table: Array, points_inB: Array,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """Iterate the update about the newest estimate until it stands.

    Args:
        mean, P: the prior, `State.mean` and (size, size).
        z: (2n,) pixels.  R: (2n + 2, 2n + 2), the last two rows for the tilt, see `ekf`.
        T, cameras, balls, lags_s, table, points_inB: as `pixels` takes them.
    Returns:
        dx (size,); innovation (2n + 2,) and H (2n + 2, size) there, for one linear update from the prior; the
        posterior's variances (size,). NaN when a ball comes to lie behind a camera.
    Source: iterated EKF, Bell and Cathey, IEEE Trans. Automatic Control 38 (1993): with H at the newest estimate and
        dx its distance from the prior, the linear update's innovation is z - h + H dx (3). About dx, d/d dx
        is H G, G from `moved_slope` (4).
    """
    size, rows = len(P), len(R)
    dx, y, variances = np.zeros(size), np.zeros(rows), np.zeros(size)
    H = np.zeros((rows, size))
    E, J_r = np.empty((3, 3)), np.empty((3, 3))
    for _ in range(MAX_ITERATIONS):
        now = moved(mean, dx, E, J_r)
        G = moved_slope(mean, now, E, J_r, size)
        h, slope = pixels(now, T, cameras, balls, lags_s, table, points_inB)
        if not np.isfinite(h).all():
            dx[:] = math.nan
            break
        H[: rows - TILT_ROWS] = slope
        _tilt(now, H, y)
        for i in range(rows - TILT_ROWS):
            y[i] = z[i] - h[i]
        _told_from_prior(H, G)  # (4)
        for i in range(rows):
            for j in range(size):
                y[i] += H[i, j] * dx[j]  # (3)
        new, biggest = _linear(P, H, R, y, dx, variances)
        dx = new
        if biggest < CONVERGED_SIGMA:
            break
    return dx, y, H, variances
