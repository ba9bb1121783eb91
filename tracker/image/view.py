"""What a camera is expected to see of each ball, for who looks for it: one compiled call a camera."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from tracker.camera import Camera
from tracker.filter.measure import camera_table, marker_points, pixels, project
from tracker.image.outline import OUTLINE_SIZE, outline
from tracker.maths.compiled import compiled
from tracker.rig import Rig
from tracker.state import State
from tracker.types import Array

U, V, S_UU, S_UV, S_VV, SPEED_U, SPEED_V, RAY_X, RAY_Y, DEPTH, RADIUS, _COLUMNS = *range(11), 10 + OUTLINE_SIZE
LONGER_U, LONGER_UV, SHIFT_U, SHIFT_V = range(RADIUS + 1, _COLUMNS)


@lru_cache(maxsize=16)
def _radii(rig: Rig) -> Array:
    """Return the balls' radii (n,) [m]."""
    return np.array([ball.radius_m for ball in rig.marker.balls])


def expected_views(state: State, rig: Rig, camera: int, t_ns: int) -> Array:
    """Return what a camera is expected to see, a row each ball, for a frame that the camera stamped t_ns.

    Args:
        state: may be of another time than t_ns; its velocities and accelerations bridge the difference.
    Returns:
        (n, 15): centre U, V [px], NaN behind the camera; its covariance S_UU, S_UV, S_VV, a pixel of doubt about the
        prediction included [px^2]; how fast its image moves, SPEED_U, SPEED_V [px/s]; and by the state's own time the
        ray to it (RAY_X, RAY_Y, 1) in C, its DEPTH before the camera [m], and its outline from RADIUS on, see
        `outline.RADIUS`.
    """
    lag_s = (t_ns - state.t_ns) * 1e-9
    table, points, seen_by = camera_table(rig), marker_points(rig), rig.cameras[camera]
    views = _views(state.mean, state.manoeuvre_s, state.P, camera, lag_s, table, points, _radii(rig))
    return _rolled(views, seen_by) if seen_by.readout_ns else views


def _rolled(views: Array, camera: Camera) -> Array:
    """Carry each ball on to the time when a rolling shutter comes to it.

    Source: with s seconds a row, ball and shutter meet at the row v' = v + v_dot s (v' - middle): one linear equation.
        A vehicle would have to be seen falling faster than the shutter to have none.
    """
    row_s, middle = camera.row_ns * 1e-9, (camera.height_px - 1) / 2.0
    late_s = row_s * (views[:, V] - middle) / np.maximum(1.0 - row_s * views[:, SPEED_V], 0.1)
    views[:, U] += late_s * views[:, SPEED_U]
    views[:, V] += late_s * views[:, SPEED_V]
    return views


CLEAR = 3.0  # times as far from its middle as the balls a vehicle reaches, with rotor and tail


def whereabouts(state: State, rig: Rig, camera: int) -> tuple[float, float, float]:
    """Return where a camera sees the vehicle's middle (u, v), NaN behind it, and how far round it reaches [px]."""
    return _whereabouts(state.mean, camera_table(rig)[camera], CLEAR * reach_m(rig) * rig.cameras[camera].focal_px)


@compiled("UniTuple(f8, 3)(f8[::1], f8[::1], f8)")
def _whereabouts(mean: Array, camera: Array, reach: float) -> tuple[float, float, float]:
    """Return what `whereabouts` does; reach [m px]."""
    distance2 = 0.0
    for i in range(3):
        distance2 += (mean[i] - camera[21 + i]) ** 2
    u, v = project(mean[:3], camera, np.empty((2, 3)))
    return u, v, reach / math.sqrt(distance2)


@compiled("void(f8[::1], f8[::1], f8[::1], f8[::1], f8[::1])")
def _place(mean: Array, m_inB: Array, camera: Array, ball_inW: Array, view: Array) -> None:
    """Fill in a ball's centre (3,), the ray to it and its depth."""
    X = Y = Z = 0.0
    for i in range(3):
        ball_inW[i] = mean[i]
        for j in range(3):
            ball_inW[i] += mean[3 + 3 * i + j] * m_inB[j]
        d = ball_inW[i] - camera[21 + i]
        X, Y, Z = X + camera[12 + 3 * i] * d, Y + camera[13 + 3 * i] * d, Z + camera[14 + 3 * i] * d
    view[RAY_X], view[RAY_Y], view[DEPTH] = X / Z, Y / Z, Z


@compiled("f8[:, ::1](f8[::1], f8, f8[:, ::1], i8, f8, f8[:, ::1], f8[:, ::1], f8[::1])")
def _views(
    mean: Array, T: float, P: Array, camera: int, lag_s: float, table: Array, points_inB: Array, radii_m: Array
) -> Array:
    """Fill in the rows of `expected_views`."""
    n = len(points_inB)
    views, work = np.empty((n, _COLUMNS)), np.empty((8, 3))
    h, H = pixels(mean, T, np.full(n, camera), np.arange(n), np.full(n, lag_s), table, points_inB)
    for b in range(n):
        view, H_u, H_v = views[b], H[2 * b], H[2 * b + 1]
        view[U], view[V] = h[2 * b], h[2 * b + 1]
        view[S_UU], view[S_UV], view[S_VV] = 1.0, 0.0, 1.0
        for i in range(len(P)):
            PH_u, PH_v = 0.0, 0.0
            for j in range(len(P)):
                PH_u += P[i, j] * H_u[j]
                PH_v += P[i, j] * H_v[j]
            view[S_UU] += H_u[i] * PH_u
            view[S_UV] += H_u[i] * PH_v
            view[S_VV] += H_v[i] * PH_v
        view[SPEED_U], view[SPEED_V] = 0.0, 0.0
        for i in range(6):  # the pose goes with velocity and rate, which stand after the attitude
            view[SPEED_U] += H_u[i] * mean[12 + i]
            view[SPEED_V] += H_v[i] * mean[12 + i]
        _place(mean, points_inB[b], table[camera], work[7], view)
        outline(work[7], radii_m[b], table[camera], work[:7], view[RADIUS:])
    return views


@compiled("f8(f8[::1], f8[:, ::1], f8[:, ::1], f8[::1], f8)")
def _smear(mean: Array, P: Array, table: Array, seconds_by_px: Array, reach_m: float) -> float:
    """Return the largest of the cameras' streaks, see `unknown_streak_px`."""
    variance, streak_px = 0.0, 0.0
    for i in range(3):
        variance += (P[6 + i, 6 + i] + reach_m * reach_m * P[9 + i, 9 + i]) / 3.0
    for c in range(len(table)):
        distance2 = 0.0
        for i in range(3):
            distance2 += (mean[i] - table[c, 21 + i]) ** 2
        streak_px = max(streak_px, math.sqrt(variance / distance2) * seconds_by_px[c])
    return streak_px


@lru_cache(maxsize=16)
def reach_m(rig: Rig) -> float:
    """Return how far the farthest ball is from their middle [m]."""
    points = rig.marker.points_inB
    return float(np.linalg.norm(points - points.mean(axis=0), axis=1).max())


@lru_cache(maxsize=64)
def _seconds_by_px(rig: Rig, exposures_s: tuple[float, ...]) -> Array:
    """Return each camera's exposure by its focal length [s px]."""
    return np.array([camera.focal_px * s for camera, s in zip(rig.cameras, exposures_s, strict=True)])


def unknown_streak_px(state: State, rig: Rig, exposures_s: tuple[float, ...]) -> float:
    """Return one sigma of how far the balls' images may be smeared that a state does not know of [px].

    exposures_s: of each camera.
    """
    return _smear(state.mean, state.P, camera_table(rig), _seconds_by_px(rig, exposures_s), reach_m(rig))
