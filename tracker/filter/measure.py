"""Where a state says the balls should be seen, with the Jacobian by the state's error."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from tracker.filter.matern import faded
from tracker.maths.compiled import compiled
from tracker.maths.so3_compiled import turn_into
from tracker.rig import Rig
from tracker.state import State
from tracker.types import Array

Indices = NDArray[np.int64]
CAMERA_SIZE = 24  # fx fy cx cy, 8 of distortion, R_CtoW by rows, p_CinW


@lru_cache(maxsize=16)
def camera_table(rig: Rig) -> Array:
    """Return the cameras' calibrations (cameras, CAMERA_SIZE), for compiled code."""
    table = np.zeros((len(rig.cameras), CAMERA_SIZE))
    for row, camera in zip(table, rig.cameras, strict=True):
        row[:4] = camera.K[0, 0], camera.K[1, 1], camera.K[0, 2], camera.K[1, 2]
        row[4 : 4 + len(camera.distortion)] = camera.distortion
        row[12:21] = camera.R_CtoW.reshape(9)
        row[21:] = camera.p_CinW
    return table


@lru_cache(maxsize=16)
def marker_points(rig: Rig) -> Array:
    """Return the balls' centres (n, 3) in B, for compiled code, which takes no read-only array [m]."""
    return np.array(rig.marker.points_inB)


def predicted_pixels(state: State, rig: Rig, camera: int, t_ns: int) -> tuple[Array, Array]:
    """Project every ball of the marker into one camera, for a frame that the camera stamped t_ns.

    Args:
        state: may be of another time than t_ns; its velocities and accelerations bridge the difference.
    Returns:
        uv_px: (n, 2); NaN for a ball behind the camera.
        H: (n, 2, size) d uv / d error of the state.
    """
    balls = np.arange(len(rig.marker))
    lags_s = np.full(len(balls), (t_ns - state.t_ns) * 1e-9)
    cameras = np.full(len(balls), camera)
    h, H = pixels(state.mean, state.manoeuvre_s, cameras, balls, lags_s, camera_table(rig), marker_points(rig))
    return h.reshape(-1, 2), H.reshape(len(balls), 2, -1)


@compiled("UniTuple(f8, 2)(f8[::1], f8[::1], f8[:, ::1])")
def project(ball_inW: Array, camera: Array, J: Array) -> tuple[float, float]:
    """Return the pixel of a point (3,), NaN behind the camera, and write d pixel / d point (2, 3) into J [px/m].

    Source: OpenCV's pinhole model with k1 k2 p1 p2 k3 k4 k5 k6, and its derivative by the chain rule.
    """
    fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6 = camera[:12]
    X, Y, Z = 0.0, 0.0, 0.0
    for i in range(3):
        d = ball_inW[i] - camera[21 + i]
        X, Y, Z = X + camera[12 + 3 * i] * d, Y + camera[13 + 3 * i] * d, Z + camera[14 + 3 * i] * d
    if Z <= 0.0:
        J[:, :] = math.nan
        return math.nan, math.nan
    x, y = X / Z, Y / Z
    r2 = x * x + y * y
    above, below = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3)), 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
    radial = above / below
    grows = (k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3) - radial * (k4 + r2 * (2.0 * k5 + 3.0 * r2 * k6))) / below
    across = 2.0 * x * y * grows + 2.0 * (p1 * x + p2 * y)
    ux = fx * (radial + 2.0 * x * x * grows + 2.0 * p1 * y + 6.0 * p2 * x)
    vy = fy * (radial + 2.0 * y * y * grows + 6.0 * p1 * y + 2.0 * p2 * x)
    uy, vx = fx * across, fy * across
    for i in range(3):
        right, down, ahead = camera[12 + 3 * i], camera[13 + 3 * i], camera[14 + 3 * i]
        J[0, i] = (ux * (right - x * ahead) + uy * (down - y * ahead)) / Z
        J[1, i] = (vx * (right - x * ahead) + vy * (down - y * ahead)) / Z
    u = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
    v = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
    return fx * u + cx, fy * v + cy


@compiled("void(f8[:, ::1], f8[:, ::1], f8[::1], f8[:, ::1])")
def _turning(J: Array, R: Array, m: Array, slope: Array) -> None:
    """Write -J R [m]x (2, 3), how a pixel goes when the arm m in R's frame turns, into slope."""
    for k in range(2):
        a = J[k, 0] * R[0, 0] + J[k, 1] * R[1, 0] + J[k, 2] * R[2, 0]
        b = J[k, 0] * R[0, 1] + J[k, 1] * R[1, 1] + J[k, 2] * R[2, 1]
        c = J[k, 0] * R[0, 2] + J[k, 1] * R[1, 2] + J[k, 2] * R[2, 2]
        slope[k, 0] = m[1] * c - m[2] * b
        slope[k, 1] = m[2] * a - m[0] * c
        slope[k, 2] = m[0] * b - m[1] * a


@compiled("Tuple((f8[::1], f8[:, ::1]))(f8[::1], f8, i8[::1], i8[::1], f8[::1], f8[:, ::1], f8[:, ::1])")
def pixels(
    mean: Array, T: float, cameras: Indices, balls: Indices, lags_s: Array, table: Array, points_inB: Array
) -> tuple[Array, Array]:
    """Project balls into cameras, each sighting at its own time.

    Args:
        mean: `State.mean`.  T: how long an acceleration lasts [s].
        cameras, balls, lags_s: (n,) of each sighting; the lag is its stamp after the state's time.
        table, points_inB: as `camera_table` and `marker_points` give them.
    Returns:
        h (2n,) pixels, NaN behind a camera; H (2n, size) d pixel / d error.
    Source: with tau = lag + offset, place and speed what `faded` leaves after tau of an acceleration (_a) and of a jerk
        (_j), phi = w tau + alpha place_a + beta place_j and E = exp(phi), ball m stands at
        p + v tau + a place_a + j place_j + R E m. An error turns it by d(R exp(theta) E m) = -R [E m]x theta and
        d(R exp(phi + d) m) = -R E [m]x J_r(phi) d (1). It moves with v + a speed_a + j speed_j, and phi grows likewise.
    """
    n = len(cameras)
    h, H = np.empty(2 * n), np.zeros((2 * n, 23 + len(table)))
    small = np.empty((22, 3))  # in one piece: to ask for memory takes as long as to fill it
    R, RE, E, J_r = small[:3], small[3:6], small[6:9], small[9:12]
    J, by_theta, by_phi = small[12:14], small[14:16], small[16:18]
    ball_inW, arm, v, w = small[18], small[19], small[20], small[21]
    for i in range(3):
        R[i] = mean[3 + 3 * i : 6 + 3 * i]
    for s in range(n):
        c, m = cameras[s], points_inB[balls[s]]
        tau = lags_s[s] + mean[30 + c]
        place_a, speed_a, _, _, place_j, speed_j, _, _ = faded(tau, T)
        phi = tau * mean[15:18] + place_a * mean[21:24] + place_j * mean[27:30]
        turn_into(phi[0], phi[1], phi[2], E, J_r)
        for i in range(3):
            arm[i] = E[i, 0] * m[0] + E[i, 1] * m[1] + E[i, 2] * m[2]
            v[i] = mean[12 + i] + speed_a * mean[18 + i] + speed_j * mean[24 + i]
            w[i] = mean[15 + i] + speed_a * mean[21 + i] + speed_j * mean[27 + i]
        for i in range(3):
            ball_inW[i] = mean[i] + tau * mean[12 + i] + place_a * mean[18 + i] + place_j * mean[24 + i]
            for j in range(3):
                ball_inW[i] += R[i, j] * arm[j]
                RE[i, j] = R[i, 0] * E[0, j] + R[i, 1] * E[1, j] + R[i, 2] * E[2, j]
        h[2 * s], h[2 * s + 1] = project(ball_inW, table[c], J)
        _turning(J, R, arm, by_theta)
        _turning(J, RE, m, by_phi)
        for k in range(2):
            row = H[2 * s + k]
            for i in range(3):
                turned = by_phi[k, 0] * J_r[0, i] + by_phi[k, 1] * J_r[1, i] + by_phi[k, 2] * J_r[2, i]  # (1)
                row[i], row[3 + i] = J[k, i], by_theta[k, i]
                row[6 + i], row[9 + i] = tau * J[k, i], tau * turned
                row[12 + i], row[15 + i] = place_a * J[k, i], place_a * turned
                row[18 + i], row[21 + i] = place_j * J[k, i], place_j * turned
                if c > 0:  # J_r(phi) d phi / d tau is the body's rate then, up to the bracket of phi and its rate
                    row[23 + c] += J[k, i] * v[i] + turned * w[i]
    return h, H
